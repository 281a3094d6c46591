"""Geometry as typed."""

from ..ownership import by_specimen
from .declaration import MACHINE, Declaration, Law, factor

EFFECT = Declaration(
    mechanism="a specimen's height differs from the entered one, which scales its strain",
    reveals="the specimen measured with a calliper",
    remedy="measure the specimen and correct the height that was entered",
    differs=Law(
        MACHINE,
        (factor("height", 0.03, "true over typed, less 1; misread or mistyped", (-0.2, 0.2)),),
        # Of a specimen higher than typed by a share, which was strained less.
        {"strain": lambda strain, v, at: strain / (1.0 + v["height"])},
    ),
    groups=by_specimen,
)

"""Seating."""

from .declaration import EITHER, Declaration

EFFECT = Declaration(
    mechanism="gaps at the specimen's faces close before it carries load",
    reveals="a preload; two specimen lengths",
    remedy="preload the specimen until its faces are in full contact",
    shown_by={
        "blocked_force": "the tip run up to the load cell until it reads, before any pressure",
    },
    of=EITHER,
    instrument=True,
    grips=True,
)

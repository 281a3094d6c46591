"""Requests to the process that bends a unit live; no solver is loaded.

request.json: `number` of the latest request, whose study is in `asked/NUMBER`, `pressure_kPa`, found first,
`fields`, whether stress and stretch are asked for, and `shapes`, the folder in which found ones are kept.
bent.json: `number` of the request that it answers, `folder` of the motion, `states` as pairs of kPa and
degrees, relative `error` of the angle, `finished`, and `trouble` if no shape was found.
"""

from __future__ import annotations

from pathlib import Path

import attrs

from .. import meshing
from ..errors import InputError
from ..studies.unit_ranking import UnitStudy

REQUEST, BENT, ASKED = "request.json", "bent.json", "asked"
CELLS = "cells"
"""Meshes of lattice cells that are not swept, kept from design to design."""
LEVELS = ((0.35, 0.09), (0.5, 0.03), (1.0, 0.0))
"""Refinements in order, each with its relative error of the angle (docs/engineering/decisions.md)."""


def trouble_of(study: UnitStudy) -> str:
    """Reason why a study's unit is not bent live, or ""."""
    if study.obstacles:
        return "with obstacles, only Simulate bends a unit"
    if study.in_time:
        return "a wall with memory is bent by Simulate only"
    return ""


def ask(
    folder: Path,
    number: int,
    study: UnitStudy,
    pressure_kPa: float,
    fields: bool = False,
    shapes: Path | None = None,
) -> None:
    """Write a request to the process of a folder: bend this study's unit. Raises InputError, OutputError.

    pressure_kPa: found first, and above the protocol's pressures the largest. fields: find stress and
    stretch, too, after the shape. shapes: folder in which its shapes are kept (`known`), None for none.
    """
    from ..files import write_json
    from ..studies.starting import write_study

    mesh = meshing.MeshSettings(refine=LEVELS[0][0])
    study = attrs.evolve(
        study, mesh=mesh, self_contact=False, self_friction=0.0, stages=("design", "simulate")
    )
    if reason := trouble_of(study):
        raise InputError(reason, "live bending", "switch it off, or change the unit")
    write_study(study, folder / ASKED / str(number))
    kept = "" if shapes is None or study.body is not None or study.effects else str(shapes)
    asked = {"number": number, "pressure_kPa": pressure_kPa, "fields": fields, "shapes": kept}
    write_json(folder / REQUEST, asked)

"""Resume of a run from its folder: the use case of its inputs, run from where it stopped."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

import attrs

from ..errors import InputError
from ..run.context import RunContext
from ..run.usecase import UseCase
from ..studies import STUDIES, study
from ..studies.use_case import use_case

# Modules with `USE_CASE` by the first file of inputs, imported on demand.
MODULES = {
    "prepare.toml": ".prepare",
    "live.toml": ".live_bending.run",
    "record.toml": ".sensor.record",
    "graph.toml": ".graph.run",
}


def use_case_of(folder: Path) -> UseCase[Any]:
    """Use case of a folder's inputs; raises InputError without one."""
    # Not the Path's own question, which raises for a name that the system refuses.
    there = [module for name, module in MODULES.items() if os.path.isfile(folder / name)]
    cases: list[UseCase[Any]] = [import_module(module, __package__).USE_CASE for module in there]
    there_too = [name for name in STUDIES if os.path.isfile(folder / study(name).layout().inputs)]
    cases += [use_case(name) for name in there_too]
    if cases:
        # A file whose first line is another's is read all the same: its reader reports the fault best.
        return next((case for case in cases if case.layout.is_of(folder)), cases[0])
    of_studies = dict.fromkeys(study(n).layout().inputs for n in STUDIES if not study(n).joins)
    names = (*MODULES, *of_studies)
    raise InputError(
        "this folder contains no study and no other run",
        str(folder),
        f"give a folder that holds one of {', '.join(names)}, as a run writes it",
    )


def resume(folder: Path, context: RunContext, given: Mapping[str, Any] = MappingProxyType({})) -> Any:
    """Run a folder's inputs, taking finished stages from its cache; returns the result.

    given: fields of the job that replace the folder's, such as `workers`, where its job has them. Raises
    InputError where the inputs cannot be used or a file that they name is missing, and the errors of the run
    itself.
    """
    use_case = use_case_of(folder)
    job = use_case.read(folder)
    fields = {field.name for field in attrs.fields(type(job))}
    job = attrs.evolve(job, **{name: value for name, value in given.items() if name in fields})
    return use_case.start(job, folder, context)

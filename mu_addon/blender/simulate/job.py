"""The unit's simulation as a job in a child process."""

from __future__ import annotations

from ..jobs.start_child import JobKind
from . import study_folder as studies

SIMULATION = JobKind("simulate", lambda root: root.mu_unit.uuid, studies.folder_of)

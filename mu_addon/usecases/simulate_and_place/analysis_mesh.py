"""The analysis mesh of a study, from its cache where it is there: cells of some lattices have no seed."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from ...body.printed_mesh import mesh_printed
from ...design.parameters import Material
from ...design.wall_material import Wall
from ...meshing.mesh import Mesh
from ...meshing.settings import MeshSettings
from ...run.cache import Cache, key
from .job import Job


def analysis_mesh(
    job: Job, settings: MeshSettings, cache: Cache, on_progress: Callable[[float], None]
) -> Mesh:
    """Mesh of a job's unit. Raises InputError and MeshingError."""
    settings = job.mesh_settings(settings)
    # Only the shape: material and name do not change a mesh, but a wall with memory has no beams.
    shape = attrs.evolve(job.unit, name="shape", material=Material(), wall=Wall())
    body = [] if job.body is None else [job.body.hash]
    name = key(shape.hash(), attrs.astuple(settings), job.unit.wall.has_memory, *body)
    found = cache.get("mesh", name)
    fields = [f.name for f in attrs.fields(Mesh)]
    if found is not None and set(found) == set(fields):
        symmetry = tuple(str(axis) for axis in found.pop("symmetry"))
        return Mesh(**found, symmetry=symmetry)
    mesh = mesh_printed(job.unit, settings, lambda _, share: on_progress(share), cache.folder, job.body)
    arrays = {f: getattr(mesh, f) for f in fields}
    cache.put("mesh", name, {**arrays, "symmetry": np.array(mesh.symmetry, dtype="U1")})
    return mesh

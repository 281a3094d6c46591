"""The analysis mesh of a study, from its cache where it is there: one of its meshers is not repeatable."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import attrs
import numpy as np

from ...design.parameters import Material
from ...design.wall_material import Wall
from ...meshing.homogenised_unit import MeshingWarning
from ...meshing.mesh import Mesh
from ...meshing.settings import MeshSettings
from ...resolved.printed_mesh import mesh_of
from ...run.cache import Cache, key
from .job import Job


def analysis_mesh(
    job: Job,
    settings: MeshSettings,
    cache: Cache,
    on_progress: Callable[[float], None],
    warn: Callable[[str], None],
) -> Mesh:
    """Mesh of a job's unit; warns where another mesher had to take its place. Raises MeshingError."""
    settings = job.mesh_settings(settings)
    # Only the shape: material and name do not change a mesh.
    shape = attrs.evolve(job.unit, name="shape", material=Material(), wall=Wall())
    body = [] if job.body is None else [job.body.hash]
    name = key(shape.hash(), attrs.astuple(settings), job.mesher, *body)
    found = cache.get("mesh", name)
    fields = [f.name for f in attrs.fields(Mesh)]
    if found is not None and set(found) == set(fields):
        symmetry = tuple(str(axis) for axis in found.pop("symmetry"))
        return Mesh(**found, symmetry=symmetry)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mesh = mesh_of(
            job.unit, settings, lambda _, share: on_progress(share), job.mesher, cache.folder, job.body
        )
    fallback = [w for w in caught if issubclass(w.category, MeshingWarning)]
    for warning in fallback:
        warn(str(warning.message))
    # A substitute's mesh is cached by its mesher; here it would pass for the one asked for.
    if not fallback:
        arrays = {f: getattr(mesh, f) for f in fields}
        cache.put("mesh", name, {**arrays, "symmetry": np.array(mesh.symmetry, dtype="U1")})
    return mesh

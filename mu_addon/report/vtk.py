"""Meshes and motions as VTK files: a .vtu a state, and a .pvd that gives each its time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ..arrays import Array
from ..fem.state import State
from ..files import make_folder, replacing, write_text
from ..meshing.mesh import Mesh

_CELL = {4: "tetra", 10: "tetra10"}


def write_mesh(path: Path, mesh: Mesh, modulus_MPa: Array, displacement: Array | None = None) -> None:
    """Write a mesh with region (m,), modulus (m,) in MPa and displacement (n, 3) in mm to a binary .vtu file.

    Without a displacement it is 0. Raises OutputError.
    """
    cells: dict[str, Array] = {
        "region": mesh.region.astype(np.int32),
        "E_MPa": np.asarray(modulus_MPa, np.float64),
    }
    moved = np.zeros_like(mesh.nodes) if displacement is None else displacement
    _write(path, mesh, {"displacement_mm": np.asarray(moved, np.float64)}, cells)


def write_fields(path: Path, mesh: Mesh, fields: dict[str, Array]) -> None:
    """Write a mesh with region and named values (m,) of its elements, each in its own unit, to a .vtu file.

    Values are in single precision. Raises OutputError.
    """
    cells = {name: np.asarray(values, np.float32) for name, values in fields.items()}
    _write(path, mesh, {}, {"region": mesh.region.astype(np.int32), **cells})


def write_trajectory(
    path: Path,
    mesh: Mesh,
    states: Sequence[tuple[float, State]],
    cells: Callable[[State], dict[str, Array]] = lambda state: {},
) -> None:
    """Write states, each with its time in s, to a .pvd file and one .vtu file a state, displacement in mm.

    cells: values (m,) of the elements in a state, by name, written in single precision. The .vtu files lie in
    a folder of the .pvd file's name, from which those of an earlier run are removed. A state that holds at
    several times is written once. Raises OutputError.
    """
    folder = make_folder(path.with_suffix(""))
    files: dict[int, str] = {}
    lines = []
    for time, state in states:
        # Not by its pressure: with friction one pressure has several states.
        if id(state) not in files:
            name = files[id(state)] = f"{len(files):04d}.vtu"
            moved = {"displacement_mm": state.u.astype(np.float32)}
            values = {name: np.asarray(v, np.float32) for name, v in cells(state).items()}
            _write(folder / name, mesh, moved, {"region": mesh.region.astype(np.int32), **values})
        file = quoteattr(f"{folder.name}/{files[id(state)]}")
        pressure = f"{state.pressure_kPa:.9g} kPa"
        lines.append(f'    <DataSet timestep="{time:.9g}" name="{pressure}" file={file}/>')
    write_text(
        path,
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        "  <Collection>\n" + "\n".join(lines) + "\n  </Collection>\n</VTKFile>\n",
    )
    for old in set(folder.glob("*.vtu")) - {folder / name for name in files.values()}:
        with suppress(OSError):
            old.unlink()


def _write(path: Path, mesh: Mesh, point_data: dict[str, Array], cell_data: dict[str, Array]) -> None:
    import meshio

    whole = meshio.Mesh(
        mesh.nodes,
        [(_CELL[mesh.tets.shape[1]], mesh.tets)],
        point_data=point_data,
        cell_data={name: [values] for name, values in cell_data.items()},
    )
    with replacing(path) as beside:
        whole.write(beside, file_format="vtu", binary=True, compression="zlib")

"""Files of a unit for printers and CAD, each read back and compared, with a manifest."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from ...design.beams import beam_parts
from ...design.lattice import lattice_of
from ...design.printing.printer import load_printer
from ...design.printing.vents import Vented, vented
from ...design.solid import QUALITY, Solid, build_solid
from ...design.stl_and_nodes import write_nodes
from ...design.surface import area, bad_edges, genus, stl_bytes, stl_surface, volume
from ...design.threemf import Part, read_3mf, write_3mf
from ...errors import MeshingError, OutputError
from ...files import write_bytes, write_json
from ...run.context import RunContext
from ...run.progress import Progress
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from .job import LAYOUT, MANIFEST, Deformed, Job, read_job, resin_of

Array = NDArray[np.float64]

MESH_TOLERANCE = 1e-4
SOLID_S = {"interactive": 2.0, "export": 11.0}
FORMAT_S = {"stl": 0.8, "3mf": 7.0, "3mf-beams": 7.0, "step": 8.0, "txt": 0.1, "deformed": 10.0}
"""Approximate seconds to write a format and read it back."""
"""Relative difference of volume allowed between a solid and its STL or 3MF read back."""
STEP_TOLERANCE = 5e-3
"""Relative difference of volume allowed of a STEP file, through its mesh."""

# In which order CAD takes the bodies, and what each does to those before it.
_ASSEMBLY = (
    ("envelope.step", "base body: the box of the lattice without the actuator"),
    ("membrane.step", "add: wall, end caps and inlet"),
    ("waveguide.step", "add after all other solids: bar and seats, already trimmed"),
    ("cavity.step", "subtract after everything was added, or keep as the volume of air"),
)


@attrs.define
class Export:
    """State of an export; files are in `folder` as soon as they are complete."""

    job: Job
    folder: Path
    context: RunContext
    files: list[dict[str, Any]] = attrs.field(factory=list)
    refused: list[dict[str, str]] = attrs.field(factory=list)
    vented: Vented | None = None

    @property
    def progress(self) -> Progress:
        """Progress of the run."""
        return self.context.progress

    def run(self) -> None:
        """Build the solid, write every format, read each back, and write the manifest."""
        job = self.job
        with self.progress.stage("solid", SOLID_S[job.quality]):
            solid = build_solid(job.unit, job.path, job.quality, take_off=job.take_off)
            self.progress.made(f"{len(solid.triangles)} triangles")
        if job.vent_along is not None:
            with self.progress.stage("vents", 10.0):
                solid = self._vent(solid, job.vent_along)
        for name in job.formats:
            with self.progress.stage(name, FORMAT_S[name]):
                {
                    "stl": self._stl,
                    "3mf": self._3mf,
                    "3mf-beams": self._beams,
                    "step": self._step,
                    "txt": self._nodes,
                }[name](solid)
        if job.deformed is not None:
            with self.progress.stage("deformed", FORMAT_S["deformed"]):
                self._deformed(solid, job.deformed)
        manifest = self._manifest(solid)
        write_json(self.folder / MANIFEST, manifest)
        self.context.summary |= manifest

    def _vent(self, solid: Solid, direction: tuple[float, float, float]) -> Solid:
        """The solid with vents for resin trapped along a build direction; writes their plugs."""
        found = self.vented = vented(solid.vertices, solid.triangles, direction, load_printer())
        for name in self.job.formats:
            if name in ("3mf-beams", "step"):
                self.progress.warning(f"{name} has no vents: it keeps its nominal shape", "--vent-along")
        if not found.vents:
            self.progress.warning(
                f"no vent is needed: {found.before_ml:.3g} ml are trapped at most", "--vent-along"
            )
            return solid
        for number, vent in enumerate(found.vents, 1):
            name = f"plug-{number}.stl"
            points, faces = vent.plug_surface()
            write_bytes(self.folder / name, stl_bytes(points, faces))
            back = stl_surface((self.folder / name).read_bytes())
            if bad_edges(back[1]) or abs(volume(*back) / vent.plug.volume() - 1.0) > 1e-3:
                raise _mismatch(name, "is another body than the plug")
            x, y, z = vent.outer
            what = f"plug of the vent at ({x:.2f}, {y:.2f}, {z:.2f}) mm, glued in once the unit is washed"
            self._add(name, what, {"volume_mm3": volume(*back), "open_edges": 0})
        gates = attrs.evolve(
            solid.gates,
            bad_edges=bad_edges(found.triangles),
            genus=genus(found.vertices, found.triangles),
            volume_mm3=volume(found.vertices, found.triangles),
            area_mm2=area(found.vertices, found.triangles),
            vertices=len(found.vertices),
            triangles=len(found.triangles),
        )
        return attrs.evolve(solid, vertices=found.vertices, triangles=found.triangles, gates=gates)

    def _vents(self) -> dict[str, Any] | None:
        """Entry on vents in the manifest, None where none were asked for."""
        if self.vented is None:
            return None
        return {
            "along": self.job.vent_along,
            "trapped_before_ml": self.vented.before_ml,
            "trapped_after_ml": self.vented.after_ml,
            "vents": [vent.plain() for vent in self.vented.vents],
        }

    def _stl(self, solid: Solid) -> None:
        write_bytes(self.folder / "unit.stl", stl_bytes(solid.vertices, solid.triangles))
        vertices, triangles = stl_surface((self.folder / "unit.stl").read_bytes())
        self._add(
            "unit.stl", "printable unit, binary, mm", self._compared(solid, "unit.stl", vertices, triangles)
        )

    def _deformed(self, solid: Solid, state: Deformed) -> None:
        """Write the solid as it is in a state of the simulated motion: its surface follows the mesh."""
        from ...report.motion_files import MODEL_A, read_motion

        motion = read_motion(state.run)
        number = int(np.abs(motion.state_kPa - state.kPa).argmin())
        moved = motion.carried(self.job.path_name or MODEL_A, motion.embedding(solid.vertices))[number]
        vertices = solid.vertices + moved
        gates = attrs.evolve(solid.gates, volume_mm3=volume(vertices, solid.triangles))
        bent = attrs.evolve(solid, vertices=vertices, gates=gates)
        name = f"unit_at_{state.kPa:g}_kPa.stl"
        write_bytes(self.folder / name, stl_bytes(vertices, solid.triangles))
        back = stl_surface((self.folder / name).read_bytes())
        what = f"the unit at {state.kPa:g} kPa, by the motion in {state.run}, mm"
        self._add(name, what, self._compared(bent, name, *back))

    def _3mf(self, solid: Solid) -> None:
        part = Part(self.job.unit.name, solid.vertices, solid.triangles)
        write_bytes(self.folder / "unit.3mf", write_3mf([part], [1], self.job.unit.name))
        objects, printed = read_3mf((self.folder / "unit.3mf").read_bytes())
        found = objects[printed[0]]
        self._add(
            "unit.3mf",
            "printable unit, mm",
            self._compared(solid, "unit.3mf", found.vertices, found.triangles),
        )

    def _compared(
        self, solid: Solid, name: str, vertices: Array, triangles: NDArray[np.int64]
    ) -> dict[str, Any]:
        """A mesh read back against the solid it was written from."""
        enclosed, open_edges = volume(vertices, triangles), bad_edges(triangles)
        error = enclosed / solid.gates.volume_mm3 - 1.0
        if open_edges:
            raise _mismatch(name, f"has {open_edges} edges not shared by exactly two triangles")
        if len(triangles) != len(solid.triangles):
            raise _mismatch(name, f"has {len(triangles)} triangles, expected {len(solid.triangles)}")
        if abs(error) > MESH_TOLERANCE:
            raise _mismatch(name, f"encloses {enclosed:.3f} mm3 and not {solid.gates.volume_mm3:.3f} mm3")
        return {
            "volume_mm3": enclosed,
            "volume_error": error,
            "triangles": len(triangles),
            "open_edges": open_edges,
            "bounding_box_mm": np.stack([vertices.min(axis=0), vertices.max(axis=0)]),
        }

    def _beams(self, solid: Solid) -> None:
        job, name = self.job, "unit-beams.3mf"
        parts, printed = beam_parts(job.unit.dimensions, QUALITY[job.quality], solid.bar)
        write_bytes(self.folder / name, write_3mf(parts, printed, f"{job.unit.name}, lattice as beams"))
        found, again = read_3mf((self.folder / name).read_bytes())
        read = list(found.values())
        if again != printed or len(read) != len(parts):
            raise _mismatch(name, "has other objects")
        for wrote, back in zip(parts, read, strict=True):
            if wrote.beams is not None and back.beams is not None:
                same = np.array_equal(wrote.beams.pairs, back.beams.pairs)
                if not same or abs(back.beams.volume / wrote.beams.volume - 1.0) > MESH_TOLERANCE:
                    raise _mismatch(name, "has other beams")
            elif abs(
                volume(back.vertices, back.triangles) / volume(wrote.vertices, wrote.triangles) - 1.0
            ) > (MESH_TOLERANCE) or bad_edges(back.triangles):
                raise _mismatch(name, f"has another {wrote.name}")
        beams = next(part.beams for part in read if part.beams is not None)
        measured = {
            "nodes": len(beams.nodes),
            "beams": len(beams.pairs),
            "struts": int(np.count_nonzero(~solid.bar.replaced)) if solid.bar else len(self._lattice.struts),
            "frusta_mm3": beams.volume,
        }
        self._add(name, "actuator and waveguide as meshes, lattice as beams, nominal size, mm", measured)

    def _step(self, solid: Solid) -> None:
        from ...meshing.step_file import bodies, step_volume, write_step

        d = self.job.unit.dimensions
        try:
            for number, (body, exact) in enumerate(bodies(d, solid.bar).items(), 1):
                name = f"{body}.step"
                write_step(body, d, self.folder / name, solid.bar)
                solids, found = step_volume(self.folder / name)
                if solids != 1:
                    raise _mismatch(name, f"holds {solids} solids, not one")
                if abs(found / exact - 1.0) > STEP_TOLERANCE:
                    raise _mismatch(name, f"encloses {found:.2f} mm3 and not {exact:.2f} mm3")
                self.progress.update(number / (3 + (solid.bar is not None)))
                measured = {"solids": solids, "volume_mm3": found, "volume_error": found / exact - 1.0}
                self._add(name, f"{body}, exact surfaces, nominal size, mm", measured)
        except MeshingError as error:
            self.refused.append({"format": "step", "why": error.what, "what_to_do": error.remedy})
            self.progress.warning(f"No STEP: {error.what}. What to do: {error.remedy}.")

    def _nodes(self, solid: Solid) -> None:
        write_nodes(self.job.unit, self.folder / "nodes.txt")
        lines = (self.folder / "nodes.txt").read_text(encoding="utf-8").splitlines()
        rows = [line.split() for line in lines if not line.startswith("#")]
        nodes = self._lattice.nodes
        read = np.array([row[2:] for row in rows], dtype=float)
        if read.shape != nodes.shape or np.abs(read - nodes).max() > 1e-6:
            raise _mismatch("nodes.txt", "has other nodes")
        anchors = sum(row[1].startswith("P") for row in rows)
        self._add("nodes.txt", "lattice nodes and anchors, mm", {"nodes": len(rows), "anchors": anchors})

    @property
    def _lattice(self) -> Any:
        return lattice_of(self.job.unit.dimensions)

    def _add(self, name: str, what: str, read_back: Mapping[str, Any]) -> None:
        content = (self.folder / name).read_bytes()
        digest = hashlib.sha256(content).hexdigest()
        self.files.append(
            {
                "file": name,
                "what": what,
                "bytes": len(content),
                "sha256": digest,
                "read_back": dict(read_back),
            }
        )

    def _manifest(self, solid: Solid) -> dict[str, Any]:
        job, g = self.job, solid.gates
        resin = job.resin or resin_of(None)
        written = {entry["file"] for entry in self.files}
        bar = solid.bar
        return {
            "unit": {"name": job.unit.name, "scale": job.unit.scale, "sha256": job.unit.hash()},
            "frame": "mm; z from inlet to tip, x = 0 the bending plane, +y the side with more lattice",
            "path": None
            if bar is None
            else {
                "name": job.path_name,
                "axis_mm": bar.points,
                "length_mm": bar.path_mm,
                "wells": len(bar.wells),
                "seats": len(bar.seats),
            },
            "solid": {
                "quality": job.quality,
                "volume_mm3": g.volume_mm3,
                "cavity_mm3": g.inner_volume_mm3,
                "bounding_box_mm": np.stack([solid.vertices.min(axis=0), solid.vertices.max(axis=0)]),
                "triangles": g.triangles,
                "gates": attrs.asdict(g),
            },
            "taken_off_mm": {
                "xy": job.take_off[0],
                "z": job.take_off[1],
                "source": job.offset_source or "nothing: nominal geometry",
            },
            "vents": self._vents(),
            "resin": {
                "name": resin.name,
                "density_g_per_ml": resin.density_g_per_ml,
                "ml": g.volume_mm3 / 1e3,
                "g": g.volume_mm3 / 1e3 * resin.density_g_per_ml,
            },
            "files": self.files,
            "refused": self.refused,
            "assembly": [
                {"order": order, "file": name, "how": how}
                for order, (name, how) in enumerate((a for a in _ASSEMBLY if a[0] in written), 1)
            ],
        }


def _mismatch(name: str, what: str) -> OutputError:
    return OutputError(
        f"{name}, read back, {what}", name, "report it with the unit's TOML; do not print this file"
    )


def export(job: Job, folder: Path, context: RunContext) -> None:
    """Write a unit's files in the run's folder; raises InputError, GateError and OutputError."""
    Export(job, folder, context).run()


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on an export's `summary`."""
    solid, resin = summary["solid"], summary["resin"]
    lines = [
        f"{entry['file']}: {entry['bytes'] / 1e6:.2f} MB, read back and verified"
        for entry in summary["files"]
    ]
    lines += [f"not written: {entry['format']}: {entry['why']}" for entry in summary["refused"]]
    lines.append(f"{solid['volume_mm3'] / 1e3:.2f} ml, {resin['g']:.1f} g of {resin['name']}")
    return lines


def plan_of(job: Job) -> Plan:
    """Stages of an export with the expected seconds of each on two cores."""
    vents = [("vents", 10.0)] if job.vent_along is not None else []
    names = [*job.formats, *(["deformed"] if job.deformed is not None else [])]
    return [("solid", SOLID_S[job.quality]), *vents, *((name, FORMAT_S[name]) for name in names)]


USE_CASE = UseCase("export", LAYOUT, read_job, export, console_summary, plan=plan_of)

"""A study's motion for display: displacement, stress and stretch of every state, in `motion/`.

Written as the study finds them, in single precision, and read again by whatever draws them.

- mesh.npz: the analysis mesh, and of both regions the surface: `REGION_node` (v,), `REGION_triangles` (t, 3)
  and `REGION_cut` (t,), whether a triangle lies in the mirror plane of a half mesh
- model_a.npz: `time_s`, `pressure_kPa` and `state`, (k,) each, at the protocol's samples; `state_kPa` (s,),
  `displacement_mm` (s, n, 3) and, at the surfaces, `REGION_FIELD` (s, v); with self-contact
  `REGION_contact_pressure_kPa` (s, v) as well. While states are missing also `reached` (k,), False at samples
  without their own state, which have that of the nearest one in time
- NAME.npz, of a sensor path: `state_kPa` (r,), and differences from Model A: `difference_mm` (r, n, 3) and
  `REGION_FIELD` (r, v); of a path off the mirror plane of a half mesh also those of the nodes' images,
  reflected into that half, `image_mm` and `image_REGION_FIELD`
- sensitivity.npz: `REGION_dJ_by_modulus_mm_per_MPa` (v,)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import in_kPa
from ..errors import InputError
from ..fem.embedding import Embedding, embed
from ..files import read_npz, write_npz
from ..meshing.mesh import LATTICE, MEMBRANE, Mesh
from ..placement.sampling import polynomials
from ..run.cache import key

if TYPE_CHECKING:
    from ..fem.materials import Materials
    from ..fem.trajectory import Trajectory


FOLDER = "motion"
MODEL_A = "model_a"
PLAYED = "played"
"""Files made from these to be played: point caches and embeddings."""
REGIONS = {"membrane": MEMBRANE, "lattice": LATTICE}
SENSITIVITY = "dJ_by_modulus_mm_per_MPa"
IMAGE = "image_"
"""Prefix of the names of fields of the nodes' images in the mirror plane."""
# Of a state, at the nodes of each region's surface. Stresses are Cauchy's.
FIELDS = ("von_mises_kPa", "largest_principal_stress_kPa", "largest_stretch", "smallest_stretch")
CONTACT_PRESSURE = "contact_pressure_kPa"
"""Pressure of self-contact of a state, between pieces of the unit's surface."""
# A path's motion is written only where its own file is named so.
_NOT_PATHS = ("mesh", MODEL_A, "sensitivity")


@attrs.frozen(eq=False)
class Surface:
    """Surface of one region, to draw: mesh node (v,) of each vertex, triangles (t, 3), cut (t,) bool."""

    node: Array
    triangles: Array
    cut: Array


@attrs.frozen(eq=False)
class Skin:
    """A surface as shown: for each vertex its index (v,) in its region's fields and its mesh node (v,).

    mirror (v,): -1 where the vertex is the node's image in the plane x = 0, else 1; triangles (t, 3).
    """

    place: Array
    node: Array
    mirror: Array
    triangles: Array

    def of_nodes(self, vectors: Array, image: Array | None = None) -> Array:
        """Vectors (..., v, 3) at the vertices of vectors (..., n, 3) at the nodes.

        image (..., n, 3): those of the nodes' images, reflected into the half mesh, where they differ.
        """
        found: Array = vectors[..., self.node, :].copy()
        if image is not None:
            there = self.mirror < 0
            found[..., there, :] = image[..., self.node[there], :]
        found[..., 0] *= self.mirror
        return found

    def of_surface(self, values: Array, image: Array | None = None) -> Array:
        """Values (..., v) at the vertices of values (..., w) of the region's surface; image as above."""
        found: Array = values[..., self.place].copy()
        if image is not None:
            there = self.mirror < 0
            found[..., there] = image[..., self.place[there]]
        return found


@attrs.frozen(eq=False)
class Motion:
    """Content of `motion/`: the mesh, its surfaces by region, Model A's states and their fields.

    fields: by region and name, (s, v), with the pressure of self-contact where that was simulated;
    sensitivity: by region, (v,), empty where there is none; paths: names of the sensor paths whose motion is
    there; reached: (k,), False at samples whose state was not solved yet.
    """

    folder: Path
    mesh: Mesh
    surfaces: dict[str, Surface]
    time_s: Array
    pressure_kPa: Array
    state: Array
    state_kPa: Array
    model_a: Array
    fields: dict[str, dict[str, Array]]
    sensitivity: dict[str, Array]
    paths: tuple[str, ...]
    reached: Array

    @property
    def so_far(self) -> str:
        """How many pressures are solved of a motion that lacks some, as text; empty for a whole one."""
        every, missing = ({*kPa.tolist()} for kPa in (self.pressure_kPa, self.pressure_kPa[~self.reached]))
        return f"{len(every - missing)} of {len(every)} pressures so far" if missing else ""

    @property
    def halved(self) -> bool:
        """True if the mesh is one half of the body, so that it can be shown cut open."""
        return "x" in self.mesh.symmetry

    def skin(self, region: str, cut: bool) -> Skin:
        """Surface of a region of the whole body, or with `cut`, if the mesh is a half, of that at x <= 0."""
        found = self.surfaces[region]
        every = np.arange(len(found.node))
        turn = -1.0 if self.halved and self.mesh.nodes[:, 0].max() > -self.mesh.nodes[:, 0].min() else 1.0
        if not self.halved or cut:
            triangles = found.triangles[:, ::-1] if turn < 0 else found.triangles
            return Skin(every, found.node, np.full(len(every), turn), triangles)
        outside = found.triangles[~found.cut]
        kept, numbered = np.unique(outside, return_inverse=True)
        numbered = numbered.reshape(-1, 3)
        off = self.mesh.nodes[found.node[kept], 0] != 0.0
        image = np.where(off, len(kept) + np.cumsum(off) - 1, np.arange(len(kept)))
        place = np.concatenate([kept, kept[off]])
        mirror = np.concatenate([np.ones(len(kept)), -np.ones(np.count_nonzero(off))])
        triangles = np.vstack([numbered, image[numbered[:, ::-1]]])
        return Skin(place, found.node[place], mirror, triangles)

    def displacement(self, name: str) -> Array:
        """Displacements (s, n, 3) in mm of Model A or of a path's unit, at Model A's states.

        A path's are polynomials in the pressure between the states that were solved, as its deviation is;
        beyond them it keeps the last difference.
        Raises InputError where there is no such motion.
        """
        return self.sides(name)[0]

    def sides(self, name: str) -> tuple[Array, Array | None]:
        """Return `displacement`, and that of the nodes' images, reflected into the half, if different."""
        if name == MODEL_A:
            return self.model_a, None
        found = self._path(name)
        own, image = (self._between(found, key) for key in ("difference_mm", "image_mm"))
        assert own is not None
        return self.model_a + own, None if image is None else self.model_a + image

    def field(self, name: str, region: str, field: str, skin: Skin) -> Array | None:
        """A field (s, v) of Model A or of a path's unit at a skin's vertices; None if it is unknown."""
        still = self.fields[region].get(field)
        if still is None:
            return None
        if name == MODEL_A:
            return skin.of_surface(still)
        found = self._path(name)
        own, image = (self._between(found, f"{side}{region}_{field}") for side in ("", IMAGE))
        return None if own is None else skin.of_surface(still + own, None if image is None else still + image)

    def _path(self, name: str) -> dict[str, Array]:
        found = read_npz(self.folder / f"{name}.npz")
        if found is None or found["difference_mm"].shape[1:] != self.model_a.shape[1:]:
            raise InputError(
                f"there is no motion of {name}", str(self.folder), "simulate again: Place the Sensor"
            )
        return found

    def _between(self, found: dict[str, Array], key: str) -> Array | None:
        """A path's differences at all of Model A's states, or None if its file lacks that name."""
        if key not in found:
            return None
        known = found["state_kPa"]
        inside = np.clip(self.state_kPa, min(known.min(), 0.0), max(known.max(), 0.0))
        weights = polynomials(known, inside).astype(np.float32)
        return np.asarray(np.tensordot(weights, found[key], axes=1))

    def carried(self, name: str, embedding: Embedding) -> Array:
        """Displacements (s, p, 3) in mm of embedded points at Model A's states, of Model A or of a path."""
        own, image = self.sides(name)
        moved = embedding.displacements(own)
        if image is not None:
            moved[:, embedding.mirrored] = embedding.displacements(image)[:, embedding.mirrored]
        return moved

    def embedding_file(self, points: Array) -> Path:
        """Path of the cached embedding of points (p, 3) in mm."""
        return self.folder / PLAYED / f"embedding-{key(self.mesh.hash(), points)}.npz"

    def embedding(self, points: Array) -> Embedding:
        """Points (p, 3) in mm embedded in the mesh; kept, since it takes seconds. Raises OutputError."""
        path = self.embedding_file(points)
        found = read_npz(path)
        if found is not None:
            return Embedding(**found)
        made = embed(self.mesh, points)
        write_npz(path, attrs.asdict(made, recurse=False), packed=False)
        return made

    def at(self, time_s: float) -> tuple[int, int, float]:
        """The states on either side of a time, and the share of the second; constant beyond the ends."""
        place = np.interp(time_s, self.time_s, np.arange(len(self.time_s)))
        first = min(int(place), len(self.time_s) - 2)
        return int(self.state[first]), int(self.state[first + 1]), float(place - first)

    def is_reached(self, time_s: float) -> bool:
        """Return True if the states on either side of a time are solved."""
        place = np.interp(time_s, self.time_s, np.arange(len(self.time_s)))
        return bool(self.reached[[int(place), int(np.ceil(place))]].all())


def write_model_a(
    folder: Path,
    mesh: Mesh,
    materials: Materials,
    trajectory: Trajectory,
    history: Callable[[int], Sequence[Array]] = lambda number: (),
    contact_kPa: Sequence[Array] = (),
    fields: dict[str, Array] | None = None,
    surfaces: dict[str, Surface] | None = None,
    reached: Array | None = None,
) -> list[dict[str, Array]]:
    """Write mesh.npz and model_a.npz of Model A into `folder`/motion. Raises OutputError.

    Returns of every state the fields (m,) of the elements by name, none where `fields` are given.

    history: of materials with memory in a state, by its number; contact_kPa: of every state the pressure (n,)
    at the mesh's nodes where the unit touches itself, or none without self-contact. fields: as
    `SurfaceFields.of_states` gives them, of all states or none, and surfaces, both computed where left out.
    reached: see `Motion`; all samples without.
    """
    arrays = {f.name: getattr(mesh, f.name) for f in attrs.fields(Mesh)}
    arrays["symmetry"] = np.array(mesh.symmetry, dtype="U1")
    surfaces = surfaces or surfaces_of(mesh)
    for name, surface in surfaces.items():
        arrays |= {f"{name}_{part}": values for part, values in attrs.asdict(surface).items()}
    of_elements: list[dict[str, Array]] = []
    if fields is None:
        looked = SurfaceFields(mesh, {name: surface.node for name, surface in surfaces.items()})
        fields = looked.of_states([s.u for s in trajectory.solved], materials, history, of_elements)
    found = dict(fields)
    for name, surface in surfaces.items() if len(contact_kPa) else ():
        found[f"{name}_{CONTACT_PRESSURE}"] = np.array([p[surface.node] for p in contact_kPa], np.float32)
    write_npz(folder / FOLDER / "mesh.npz", arrays, packed=False)
    write_npz(
        folder / FOLDER / f"{MODEL_A}.npz",
        {
            "time_s": trajectory.time_s,
            "pressure_kPa": trajectory.pressure_kPa,
            "state": trajectory.index,
            "state_kPa": np.array([s.pressure_kPa for s in trajectory.solved]),
            "displacement_mm": np.array([s.u for s in trajectory.solved], np.float32),
            **({} if reached is None else {"reached": reached}),
            **found,
        },
        packed=False,
    )
    return of_elements


class SurfaceFields:
    """Stress and stretch of a mesh's states at some nodes (v,) of each region, given by its name."""

    def __init__(self, mesh: Mesh, nodes: dict[str, Array]) -> None:
        from ..fem.elements import reference_gradients
        from ..fem.stress import NodalMean

        self._mesh = mesh
        self._reference = known = reference_gradients(mesh.nodes, mesh.tets)
        self._means = {r: NodalMean(mesh, np.flatnonzero(mesh.region == REGIONS[r]), known) for r in nodes}
        self._places = {r: np.searchsorted(self._means[r].nodes, node) for r, node in nodes.items()}

    def of_states(
        self,
        displacements: list[Array],
        materials: Materials,
        history: Callable[[int], Sequence[Array]] = lambda number: (),
        of_elements: list[dict[str, Array]] | None = None,
    ) -> dict[str, Array]:
        """Fields `REGION_FIELD` (s, v) of states, each given by its displacement (n, 3) in mm.

        of_elements: gets the fields (m,) of every state's elements, of the means over their points.
        """
        from ..fem.stress import cauchy

        found: dict[str, list[Array]] = {f"{r}_{field}": [] for r in self._means for field in FIELDS}
        for number, u in enumerate(displacements):
            sigma, F = cauchy(self._mesh, u, materials, history(number), self._reference)
            for region, mean in self._means.items():
                place = self._places[region]
                for field, value in _fields_of(mean(sigma)[place], mean(F)[place]).items():
                    found[f"{region}_{field}"].append(value)
            if of_elements is not None:
                of_elements.append(_fields_of(sigma.mean(axis=1), F.mean(axis=1)))
        return {name: np.array(values, np.float32) for name, values in found.items()}


def _fields_of(sigma: Array, F: Array) -> dict[str, Array]:
    """`FIELDS` (v,) of Cauchy stresses (v, 3, 3) in MPa and deformation gradients (v, 3, 3)."""
    from ..fem.lattice_law import stretches
    from ..fem.stress import von_mises

    stress_kPa, stretch = in_kPa(sigma), stretches(F)
    values = von_mises(stress_kPa), np.linalg.eigvalsh(stress_kPa)[:, 2], stretch[:, 2], stretch[:, 0]
    return {n: v.astype(np.float32) for n, v in zip(FIELDS, values, strict=True)}


def surfaces_of(mesh: Mesh) -> dict[str, Surface]:
    """Surfaces of a mesh's regions, by name."""
    return {name: surface_of(mesh, region) for name, region in REGIONS.items()}


def surface_of(mesh: Mesh, region: int) -> Surface:
    """Surface of a region of a mesh."""
    from .unit_pictures import region_skin

    triangles = region_skin(mesh, region)
    node, numbered = np.unique(triangles, return_inverse=True)
    cut = np.zeros(len(triangles), bool)
    if "x" in mesh.symmetry:
        cut = (mesh.nodes[triangles][:, :, 0] == 0.0).all(axis=1)
    return Surface(node.astype(np.int32), numbered.reshape(-1, 3).astype(np.int32), cut)


def write_path(folder: Path, name: str, state_kPa: Array, difference_mm: Array, **differences: Array) -> None:
    """Write a path's difference (r, n, 3) in mm from Model A at pressures (r,) in kPa. Raises OutputError.

    differences: further ones, (r, ...), by the names that the module's text gives.
    """
    arrays = {"difference_mm": difference_mm, **differences}
    single = {key: np.asarray(values, np.float32) for key, values in arrays.items()}
    write_npz(folder / FOLDER / f"{name}.npz", {"state_kPa": state_kPa, **single}, packed=False)


def write_sensitivity(folder: Path, mesh: Mesh, by_modulus: Array) -> None:
    """Write dJ/dE (m,) in mm/MPa of every element, averaged at the surfaces' nodes. Raises OutputError."""
    from ..fem.stress import NodalMean

    points = 1 if mesh.order == 1 else 4
    arrays = {}
    for name, region in REGIONS.items():
        mean = NodalMean(mesh, np.flatnonzero(mesh.region == region))
        values = mean(np.repeat(by_modulus[:, None], points, axis=1))
        arrays[f"{name}_{SENSITIVITY}"] = values[np.searchsorted(mean.nodes, surface_of(mesh, region).node)]
    write_npz(folder / FOLDER / "sensitivity.npz", {n: a.astype(np.float32) for n, a in arrays.items()})


def read_motion(folder: Path) -> Motion:
    """The motion in a study's folder. Raises InputError where there is none that can be read whole."""
    place = folder / FOLDER
    mesh, model = read_npz(place / "mesh.npz"), read_npz(place / f"{MODEL_A}.npz")
    remedy = "simulate again: finished stages are not repeated"
    if mesh is None or model is None:
        raise InputError("this study contains no motion", str(place), remedy)
    sensitivity = read_npz(place / "sensitivity.npz") or {}
    try:
        found = _motion(place, mesh, model, sensitivity)
    except KeyError as missing:
        raise InputError(f"the motion lacks {missing}", str(place), remedy) from None
    if not _fits(found):
        raise InputError("the files of the motion are inconsistent", str(place), remedy)
    return found


def _motion(
    place: Path, mesh: dict[str, Array], model: dict[str, Array], sensitivity: dict[str, Array]
) -> Motion:
    # Older files lack later tables, which most meshes leave empty.
    needed = [f for f in attrs.fields(Mesh) if f.name in mesh or f.default is attrs.NOTHING]
    fields = {f.name: mesh[f.name] for f in needed if f.name != "symmetry"}
    names = [p.stem for p in place.glob("*.npz") if p.stem not in _NOT_PATHS]
    return Motion(
        folder=place,
        mesh=Mesh(**fields, symmetry=tuple(str(axis) for axis in mesh["symmetry"])),
        surfaces={r: Surface(mesh[f"{r}_node"], mesh[f"{r}_triangles"], mesh[f"{r}_cut"]) for r in REGIONS},
        time_s=model["time_s"],
        pressure_kPa=model["pressure_kPa"],
        state=model["state"],
        state_kPa=model["state_kPa"],
        model_a=model["displacement_mm"],
        fields={r: _fields(model, r) for r in REGIONS},
        sensitivity={
            r: sensitivity[f"{r}_{SENSITIVITY}"] for r in REGIONS if f"{r}_{SENSITIVITY}" in sensitivity
        },
        paths=tuple(sorted(names, key=lambda name: (len(name), name))),
        reached=model.get("reached", np.ones(len(model["time_s"]), bool)),
    )


def _fields(model: dict[str, Array], region: str) -> dict[str, Array]:
    if not any(f"{region}_{name}" in model for name in FIELDS):
        return {}
    names = FIELDS + (CONTACT_PRESSURE,) * (f"{region}_{CONTACT_PRESSURE}" in model)
    return {name: model[f"{region}_{name}"] for name in names}


def _fits(m: Motion) -> bool:
    """Return True if all numbers of nodes, vertices and states are in range and all shapes agree."""
    states, nodes = len(m.state_kPa), len(m.mesh.nodes)
    fits = m.model_a.shape == (states, nodes, 3) and m.state.max(initial=0) < states
    fits = fits and len(m.time_s) == len(m.state) == len(m.pressure_kPa) == len(m.reached) > 1
    for region, surface in m.surfaces.items():
        count = len(surface.node)
        fits = fits and surface.node.max(initial=0) < nodes and surface.triangles.max(initial=-1) < count
        fits = fits and len(surface.cut) == len(surface.triangles)
        fits = fits and all(values.shape == (states, count) for values in m.fields[region].values())
        fits = fits and len(m.sensitivity.get(region, surface.node)) == count
    return bool(fits)

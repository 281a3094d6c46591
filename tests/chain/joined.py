"""Two units as one body of finite elements, to check what a chain of their joints says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from mu_addon.chain.chain import GRAVITY_N_PER_G, Loads
from mu_addon.chain.rigid_motion import motion
from mu_addon.chain.unit_between_plates import frame, tip_nodes
from mu_addon.fem.dead_loads import gravity
from mu_addon.fem.embedding import embed
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.laws import NeoHooke
from mu_addon.fem.materials import Layer, Materials
from mu_addon.fem.model import Model
from mu_addon.fem.state import State
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.mesh import LATTICE, TET_EDGES, Mesh

if TYPE_CHECKING:
    from mu_addon.design.parameters import Unit

Array = np.ndarray[Any, Any]

PLATE_MPA = 1e3
"""Young's modulus of a plate's one element: ten thousand times the lattice's."""
# Half the side of a plate's element over the unit's height.
_PLATE_SHARE = 0.3


@attrs.frozen(eq=False)
class FullModel:
    """A body of units one on the other, each with a pressure of its own, and rigid plates as stiff elements.

    mesh: one body; plate (4,): the corner nodes of the plate at the tip, height_mm: of its middle at rest.
    model, equilibrium: its finite elements; faces: number of each unit's in the mesh's cavity, in order.
    """

    mesh: Mesh
    model: Model
    equilibrium: Equilibrium
    faces: Sequence[int]
    plate: Array
    height_mm: float

    def tip(self, u: Array) -> Array:
        """Frame (4, 4) of the tip's plate under displacements u (n, 3) in mm; at rest it is on the axis."""
        before = self.mesh.nodes[self.plate]
        after = before + u[self.plate]
        weights = _weights(before, np.array([[0.0, 0.0, self.height_mm]]))[0]
        gradient = (after[1:] - after[0]).T @ np.linalg.inv((before[1:] - before[0]).T)
        left, _, right = np.linalg.svd(gradient)
        return motion(left @ right, weights @ after)

    def states(self, pressures_kPa: Sequence[Sequence[float]]) -> list[State]:
        """Equilibria at rows of pressures in kPa, each from the loaded body. Raises ConvergenceError."""
        found = []
        start = self.equilibrium.at_zero_pressure()
        for row in pressures_kPa:
            p = np.asarray(row, float) / 1e3
            largest = float(np.abs(p).max())
            if largest == 0.0:
                found.append(start)
                continue
            self.model._shares.assign(np.repeat(p / largest, self.faces))
            found.append(self.equilibrium.reach(largest, [start]))
        return found


def full_model(
    units: Sequence[Unit],
    meshes: Sequence[Mesh],
    turns_deg: Sequence[float],
    loads: Loads,
    density_g_per_ml: float,
    plate_between: bool = False,
    threads: int = 1,
) -> FullModel:
    """Units on their whole meshes as one body, the base clamped, the tip's plane on a rigid plate.

    turns_deg: of each about the axis. plate_between: whether the planes between units are on rigid plates,
    too, as joints have them; otherwise the nodes of a base are tied to the elements of the tip below, as
    printed in one piece. Loads are dead: no couple.
    """
    assert not np.any(loads.tip_couple_N_mm), "a couple is no dead load"
    nodes: list[Array] = []
    tets: list[Array] = []
    ties: list[tuple[Array, Array, Array]] = []
    layers: list[Layer] = []
    density: list[Array] = []
    plates: list[tuple[Array, float]] = []
    counts, cavities, region = [], [], []
    first, element, height = 0, 0, 0.0

    def add(x: Array, t: Array, kind: Array) -> None:
        nonlocal first, element
        nodes.append(x)
        tets.append(t + first)
        region.append(kind)
        first += len(x)
        element += len(t)

    def add_plate(z: float, side: float) -> Array:
        """Corner nodes (4,) of a stiff element on the plane at z."""
        corners = np.array([[-side, -side, z], [side, -side, z], [0.0, side, z], [0.0, 0.0, z + side]])
        start = first
        middles = corners[TET_EDGES].mean(axis=1) if meshes[0].order == 2 else np.zeros((0, 3))
        if len(middles):
            ties.append((start + 4 + np.arange(6), start + TET_EDGES, np.full((6, 2), 0.5)))
        stiff = NeoHooke.parameters(np.array([PLATE_MPA]), np.array([0.3]))
        layers.append(Layer(NeoHooke, np.array([element]), stiff))
        density.append(np.zeros(1))
        add(np.vstack([corners, middles]), np.arange(4 + len(middles))[None], np.array([LATTICE]))
        plates.append((start + np.arange(4), z))
        return start + np.arange(4)

    def tie_to_plate(rows: Array, points: Array, corners: Array) -> None:
        at = np.concatenate(nodes)[corners]
        ties.append((rows, np.tile(corners, (len(rows), 1)), _weights(at, points)))

    base: Array | None = None
    below: tuple[Mesh, int, Array, float] | None = None
    for unit, mesh, turn in zip(units, meshes, turns_deg, strict=True):
        assert not mesh.symmetry
        assert not len(mesh.tied)
        turned = frame(turn)[:3, :3]
        x = mesh.nodes @ turned.T + [0.0, 0.0, height]
        start = first
        for layer in materials_of(unit, mesh).layers:
            layers.append(attrs.evolve(layer, elements=layer.elements + element))
        density.append(np.full(len(mesh.tets), density_g_per_ml * 1e-9))
        cavities.append(mesh.cavity + start)
        counts.append(len(mesh.cavity))
        add(x, mesh.tets, mesh.region)
        if below is None:
            base = mesh.base + start
        elif plate_between:
            lower, lower_start, _, _ = below
            corners = add_plate(height, _PLATE_SHARE * float(np.ptp(mesh.nodes[:, 2])))
            whole = np.concatenate(nodes)
            for rows in (tip_nodes(lower) + lower_start, mesh.base + start):
                tie_to_plate(rows, whole[rows], corners)
        else:
            lower, lower_start, turn_below, z = below
            local = (x[mesh.base] - [0.0, 0.0, z]) @ turn_below
            follows = embed(lower, local)
            ties.append((mesh.base + start, follows.nodes + lower_start, follows.weights))
        below = (mesh, start, turned, height)
        height += float(mesh.nodes[mesh.tip[0], 2])
    assert below is not None
    assert base is not None
    last, last_start, _, _ = below
    corners = add_plate(height, _PLATE_SHARE * float(np.ptp(last.nodes[:, 2])))
    rows = tip_nodes(last) + last_start
    tie_to_plate(rows, np.concatenate(nodes)[rows], corners)

    width = max(to.shape[1] for _, to, _ in ties)
    padded = [
        (
            rows_,
            np.pad(to, ((0, 0), (0, width - to.shape[1])), "edge"),
            np.pad(w, ((0, 0), (0, width - w.shape[1]))),
        )
        for rows_, to, w in ties
    ]
    joined = Mesh(
        np.concatenate(nodes),
        np.concatenate(tets),
        np.concatenate(region),
        np.concatenate(cavities),
        base,
        rows,
        (),
        tied=np.concatenate([rows_ for rows_, _, _ in padded]),
        tied_to=np.concatenate([to for _, to, _ in padded]),
        tied_weights=np.concatenate([w for _, _, w in padded]),
    )
    model = Model(joined, threads=threads)
    pull = np.asarray(loads.tip_force_N, float)
    pull = pull + loads.tip_mass_g * GRAVITY_N_PER_G * np.asarray(loads.down, float)
    load = np.zeros_like(joined.nodes)
    load[corners] += _weights(joined.nodes[corners], np.array([[0.0, 0.0, height]]))[0][:, None] * pull
    if np.any(loads.down):
        length = float(np.linalg.norm(loads.down))
        load += length * gravity(joined, np.concatenate(density), np.asarray(loads.down, float))
    model.load = load if load.any() else None
    equilibrium = Equilibrium(model, Materials(tuple(layers)))
    return FullModel(joined, model, equilibrium, counts, corners, height)


def _weights(corners: Array, points: Array) -> Array:
    """Weights (k, 4) by which points (k, 3) follow the four corners (4, 3) of an element affinely."""
    edges = (corners[1:] - corners[0]).T
    local = np.linalg.solve(edges, (points - corners[0]).T).T
    return np.column_stack([1.0 - local.sum(axis=1), local])

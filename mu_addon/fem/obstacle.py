"""Contact of a deforming body with rigid ones: a penalty of stated depth, and Coulomb's friction."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..meshing.mesh import TRIANGLE_EDGES, Mesh
from ..meshing.quality import shapes
from . import friction
from .elements import triangle_quadrature
from .friction import Lag, Memory
from .outer_faces import OuterFaces, outer_faces
from .rigid import Pose, Rigid

# A point slides where its friction is at least this share of its bound, which lags by less than the rest.
_AT_BOUND = 0.999


@attrs.frozen(eq=False)
class ObstacleContact:
    """Contact of a state with one obstacle; forces are of the meshed body on the obstacle, (3,) in N.

    area_mm2: of the surface in contact, undeformed; sticking: the share of it that does not slide, 1 without
    contact. deepest_mm: the error of the gap. slid_mm (f, q): slid length of each point of `Obstacle.places`;
    lost_mJ: energy dissipated by sliding.
    """

    normal_N: Array
    tangential_N: Array
    area_mm2: float
    sticking: float
    deepest_mm: float
    slid_mm: Array
    lost_mJ: float

    @property
    def force_N(self) -> Array:
        """Normal and tangential force together, (3,) in N."""
        return np.asarray(self.normal_N + self.tangential_N)


class Obstacle:
    """Contact of a mesh's outer surface with a rigid body, as a term of `Model.obstacles`.

    Where a point of the surface is a depth s inside, the obstacle presses on it with k s^2/(2 d) for s < d
    and k (s - d/2) beyond, in MPa on the undeformed area, along the distance's gradient. d is `depth_mm`, and
    k is such that at `pressure_MPa` the depth is d. The depth is the error of the gap; `deepest_mm` is its
    largest value in a state. Force and tangent are continuous, and the energy is a potential of the
    displacement.

    friction: Coulomb's coefficient. The traction grows with the slip since the last committed state plus the
    earlier elastic slip, up to `friction` times the pressure. At `pressure_MPa` it reaches that bound at a
    slip of `stick_mm` (None: depth_mm). Slip is relative to the obstacle, in its frame. The bound lags:
    `Equilibrium.newton` finds an equilibrium with pressure and normal of an earlier one, and repeats this
    until friction changes by less than equilibrium.FRICTION_TOLERANCE of its bound. Energy, force and
    symmetric tangent are therefore consistent. Such a body has memory: `time_stepping.simulate_in_time`
    solves it, and commits.

    `pose` may be set between equilibria, as an obstacle that moves has it; `path`, a function of time in s,
    does so in `simulate_in_time`. Faces of the base, the cavity and mirror planes do not touch. halvings: of
    a face's sides, with quadrature points on the pieces; large faces need some to have contact near their
    edges. faces: those of `outer_faces` that can touch, to save time. In a printed mesh the parts of a strut
    inside another part do not touch, and forces on tied nodes act on their masters, as in `Model`. Methods
    take displacements u (n, 3) in mm. Raises InputError.
    """

    def __init__(
        self,
        mesh: Mesh,
        rigid: Rigid,
        pressure_MPa: float,
        depth_mm: float,
        halvings: int = 0,
        friction: float = 0.0,
        stick_mm: float | None = None,
        pose: Pose | None = None,
        path: Callable[[float], Pose] | None = None,
        faces: OuterFaces | None = None,
    ) -> None:
        stick_mm = depth_mm if stick_mm is None else stick_mm
        if not (pressure_MPa > 0 and depth_mm > 0):
            raise InputError(
                f"a contact of {pressure_MPa:g} MPa at {depth_mm:g} mm of depth",
                "obstacle",
                "give both above 0: the expected contact pressure and the penetration allowed at it",
            )
        if not (0 <= friction < np.inf and stick_mm > 0):
            raise InputError(
                f"a friction coefficient of {friction:g} that {stick_mm:g} mm of slip reach",
                "obstacle",
                "give a coefficient of 0 or more, and a slip above 0",
            )
        self.rigid, self.pose, self.path = rigid, pose or Pose(), path
        self.depth_mm, self.friction = depth_mm, friction
        self.stiffness = 2 * pressure_MPa / depth_mm
        self.stick_stiffness = friction * pressure_MPa / stick_mm
        self._rest = mesh.nodes
        outer = outer_faces(mesh) if faces is None else faces
        self.faces = outer.nodes
        points, weight = _subdivided(*triangle_quadrature(mesh.order), halvings)
        self._shape, derivative = shapes(points, TRIANGLE_EDGES, mesh.order)
        tangents = np.einsum("fni,qnk->kfqi", mesh.nodes[self.faces], derivative)
        bare = outer.bare[:, points.argmax(axis=1)]
        self._area = np.linalg.norm(np.cross(tangents[0], tangents[1]), axis=-1) * weight * bare
        # Points inside another part of the body are out of reach.
        self._out_of_reach = np.where(bare > 0, 0.0, np.inf)
        self._pairs = np.stack(np.triu_indices(self.faces.shape[1]), axis=1)
        self.begin()

    def move(self, time_s: float) -> None:
        """Set `pose` to that of `path` at a time in s; do nothing without a path."""
        if self.path is not None:
            self.pose = self.path(time_s)

    def begin(self, u: Array | None = None) -> None:
        """Reset friction's memory at displacement u (n, 3) in mm, by default at rest, without any slip."""
        if not self.friction:
            return
        y, g, n, _ = self._points(np.zeros_like(self._rest) if u is None else u)
        self.recall(Memory(y, g, n, self._pressure(g)[0], np.zeros_like(y), np.zeros_like(g)))

    def recall(self, memory: Memory) -> None:
        """Set the memory of friction to that of a committed state, and its lag with it."""
        self.memory = memory
        self.lag_from_memory()

    def kept(self) -> dict[str, Array]:
        """Friction's memory as arrays to store, of the j points with pressure or slid length.

        point (j,): their numbers among the f q; normal (j, 3); pressure (j,) in MPa; slip (j, 3) and slid
        (j,) in mm; lost_mJ: a scalar. The rest follows from the displacement, see `restore`. Empty without
        friction.
        """
        if not self.friction:
            return {}
        m = self.memory
        at = np.flatnonzero((m.pressure > 0) | (m.slid > 0))
        parts = {"normal": m.normal, "pressure": m.pressure, "slip": m.slip, "slid": m.slid}
        found = {name: a.reshape(-1, *a.shape[2:])[at] for name, a in parts.items()}
        return {"point": at, "lost_mJ": np.array(m.lost_mJ), **found}

    def restore(self, u: Array, kept: dict[str, Array]) -> None:
        """Set the memory to its value when `kept` stored it.

        u (n, 3) in mm: the last committed displacement then. Does nothing without friction.
        """
        if not self.friction:
            return
        y, g, n, _ = self._points(u)
        pressure, slip, slid = np.zeros_like(g), np.zeros_like(y), np.zeros_like(g)
        for name, a in (("normal", n), ("pressure", pressure), ("slip", slip), ("slid", slid)):
            a.reshape(-1, *a.shape[2:])[kept["point"]] = kept[name]
        self.recall(Memory(y, g, n, pressure, slip, slid, float(kept["lost_mJ"])))

    def lag_from_memory(self) -> None:
        """Take the pressure and normal that bound friction from the last committed state."""
        if self.friction:
            m = self.memory
            self.lag = Lag(m.pressure, m.normal, np.ones_like(m.pressure))

    def lag_change(self, u: Array) -> float:
        """Change of friction's forces if the lag followed to u (n, 3) in mm, over the sum of their bounds.

        0 without friction.
        """
        if not self.friction:
            return 0.0
        face = self._near(u)
        y, g, n, _ = self._points(u, face)
        memory, old = self._of(face)
        new = self._lagged(memory, g, n)
        most = float((self._area[face] * self.friction * new.pressure).sum())
        less, more = (self._tractions(y, memory, lag) for lag in (old, new))
        change = float((self._area[face] * np.linalg.norm(more - less, axis=-1)).sum())
        return change / most if most else float(change > 0)

    def update_lag(self, u: Array) -> None:
        """Update the pressure and normal that bound friction to displacement u (n, 3) in mm."""
        if not self.friction:
            return
        face, m = self._near(u), self.memory
        _, g, n, _ = self._points(u, face)
        new = self._lagged(self._of(face)[0], g, n)
        self.lag = Lag(np.zeros_like(m.pressure), m.normal.copy(), np.ones_like(m.pressure))
        self.lag.pressure[face], self.lag.normal[face] = new.pressure, new.normal
        self.lag.counts[face] = new.counts

    def commit(self, u: Array) -> None:
        """Commit a converged state u (n, 3) in mm to the memory.

        Slip beyond the bound is added to `slid`, and its work, by the mean of friction at both ends of the
        step, to `lost_mJ`. Points that no longer touch lose their elastic slip.
        """
        if not self.friction:
            return
        y, g, _, _ = self._points(u)
        old, touches = self.memory, g < 0
        e = friction.slip(old, self.lag, y)
        elastic: Array = (
            e * friction.kept(e, self.friction * self.lag.pressure, self.stick_stiffness)[..., None]
        )
        # A point that leaves loses its elastic slip, and does not slide on.
        elastic[~touches], e[~touches] = 0.0, old.slip[~touches]
        slid = e - elastic
        # Friction has changed within the step: its mean is that of both ends.
        lost = self.stick_stiffness / 2 * ((old.slip + elastic) * slid).sum(axis=-1)
        self.recall(
            Memory(
                y,
                g,
                self.lag.normal,
                np.where(touches, self.lag.pressure, 0.0),
                elastic,
                old.slid + np.where(touches, np.linalg.norm(slid, axis=-1), 0.0),
                old.lost_mJ + float((self._area * lost).sum()),
            )
        )

    def energy_mJ(self, u: Array) -> float:
        """Energy in mJ stored in the contact at u (n, 3) in mm, with that dissipated in this step."""
        face = self._near(u)
        y, g, _, _ = self._points(u, face)
        s = np.maximum(-g, 0.0)
        d, k = self.depth_mm, self.stiffness
        density = k * np.where(s < d, s**3 / (6 * d), s**2 / 2 - d * s / 2 + d**2 / 6)
        if self.friction:
            memory, lag = self._of(face)
            e = friction.slip(memory, lag, y)
            density += friction.energy(e, self.friction * lag.pressure, self.stick_stiffness) / lag.counts
        return float((self._area[face] * density).sum())

    def forces(self, u: Array) -> tuple[Array, Array]:
        """Nodes (j,) of the faces in contact, and the contact energy's derivative by them, (j, 3) in N.

        u: displacements (n, 3) in mm. A node is listed once for each of its faces.
        """
        face, y, g, n, _ = self._contact_candidates(u)
        at_points = -self._pressure(g)[0][..., None] * n
        if self.friction:
            at_points += self._tractions(y, *self._of(face))
        at_points = at_points @ self.pose.rotation.T
        of_nodes = np.einsum("fq,qa,fqi->fai", self._area[face], self._shape, at_points)
        return self.faces[face].ravel(), of_nodes.reshape(-1, 3)

    def blocks(self, u: Array) -> tuple[Array, Array]:
        """Second derivative in N/mm of the contact energy at u (n, 3) in mm.

        Returns pairs (j, 2) of nodes of one face, each once, and their blocks (j, 3, 3).
        """
        face, y, g, n, h = self._contact_candidates(u)
        pressure, slope = self._pressure(g)
        at_points = slope[..., None, None] * n[..., :, None] * n[..., None, :] - pressure[..., None, None] * h
        if self.friction:
            memory, lag = self._of(face)
            e = friction.slip(memory, lag, y)
            bound = self.friction * lag.pressure
            rubbing = friction.tangent(e, bound, self.stick_stiffness, lag.normal)
            at_points += lag.counts[..., None, None] * rubbing
        r = self.pose.rotation
        at_points = r @ at_points @ r.T
        a, b = self._pairs.T
        both = self._shape[:, a] * self._shape[:, b]
        blocks = np.einsum("fq,qp,fqij->fpij", self._area[face], both, at_points)
        pairs = self.faces[face][:, self._pairs]
        return pairs.reshape(-1, 2), blocks.reshape(-1, 3, 3)

    def contact(self, u: Array) -> ObstacleContact:
        """Forces, area and depth of the contact at displacement u (n, 3) in mm.

        With friction u must be the last committed state or one found since: slid length and lost work are
        those of the last commit.
        """
        face = self._near(u)
        y, g, n, _ = self._points(u, face)
        area, pressure = self._area[face], self._pressure(g)[0]
        touching = pressure > 0
        r = self.pose.rotation
        normal = -(area * pressure)[..., None] * n
        rubbing, sliding = np.zeros_like(y), touching
        slid, lost = np.zeros(self._area.shape), 0.0
        if self.friction:
            memory, lag = self._of(face)
            rubbing = area[..., None] * self._tractions(y, memory, lag)
            most = area * self.friction * lag.pressure
            sliding = touching & (np.linalg.norm(rubbing, axis=-1) >= _AT_BOUND * most)
            slid, lost = self.memory.slid, self.memory.lost_mJ
        touched = float(area[touching].sum())
        return ObstacleContact(
            normal.sum(axis=(0, 1)) @ r.T,
            rubbing.sum(axis=(0, 1)) @ r.T,
            touched,
            1 - float(area[sliding].sum()) / touched if touched else 1.0,
            max(0.0, -float(g.min(initial=np.inf))),
            slid,
            lost,
        )

    def force_N(self, u: Array) -> Array:
        """Force (3,) in N of the meshed body on the obstacle, at u (n, 3) in mm; of a half mesh its half."""
        _, forces = self.forces(u)
        return np.asarray(forces.sum(axis=0))

    def places(self, u: Array) -> Array:
        """Places (f, q, 3) in mm of the surface's points that may touch, at displacement u (n, 3) in mm."""
        return np.asarray(np.einsum("qa,fai->fqi", self._shape, (self._rest + u)[self.faces]))

    def gap_mm(self, u: Array) -> float:
        """Least distance in mm of the surface's points from the obstacle, negative where they touch."""
        return float(self._points(u)[1].min())

    def deepest_mm(self, u: Array) -> float:
        """Largest depth in mm of the surface in the obstacle, 0 without contact: the gap error."""
        return max(0.0, -float(self._points(u, self._near(u))[1].min(initial=np.inf)))

    def deepest_place(self, u: Array) -> Array:
        """Place (3,) in mm, deformed, of the surface's point deepest in the obstacle, or nearest to it."""
        return np.asarray(self.places(u).reshape(-1, 3)[self._points(u)[1].argmin()])

    def pressures_MPa(self, u: Array) -> tuple[Array, Array]:
        """Places (k, 3) in mm of the points in contact, deformed, and the pressure (k,) in MPa on each."""
        face = self._near(u)
        pressure = self._pressure(self._points(u, face)[1])[0]
        on = pressure > 0
        x = np.einsum("qa,fai->fqi", self._shape, (self._rest + u)[self.faces[face]])
        return x[on], pressure[on]

    def _points(self, u: Array, faces: Array | None = None) -> tuple[Array, Array, Array, Array]:
        """Position (f, q, 3), distance (f, q), its derivatives, of faces' points in the obstacle's frame."""
        chosen = slice(None) if faces is None else faces
        x = np.einsum("qa,fai->fqi", self._shape, (self._rest + u)[self.faces[chosen]])
        y = (x - self.pose.shift) @ self.pose.rotation
        g, n, h = self.rigid.distance(y.reshape(-1, 3))
        shape = x.shape[:2]
        gap = g.reshape(shape) + self._out_of_reach[chosen]
        return y, gap, n.reshape(*shape, 3), h.reshape(*shape, 3, 3)

    def _contact_candidates(self, u: Array) -> tuple[Array, ...]:
        """Faces (f,) that press or rub, and their `_points`."""
        near = self._near(u)
        y, g, n, h = self._points(u, near)
        on = (g < 0).any(axis=1)
        if self.friction:
            on |= (self.lag.pressure[near] > 0).any(axis=1)
        return near[on], y[on], g[on], n[on], h[on]

    def _near(self, u: Array) -> Array:
        """Faces (f,) that may press, by the distance of a ball around each, or rub.

        No point of a face is farther from its nodes' mean than they, times the sum of its shapes' sizes.
        """
        x = (self._rest + u)[self.faces]
        middle = x.mean(axis=1)
        reach = (
            np.linalg.norm(x - middle[:, None], axis=2).max(axis=1) * np.abs(self._shape).sum(axis=1).max()
        )
        y = (middle - self.pose.shift) @ self.pose.rotation
        on = self.rigid.distance(y)[0] < reach
        if self.friction:
            on |= (self.lag.pressure > 0).any(axis=1)
        return np.flatnonzero(on)

    def _pressure(self, gap: Array) -> tuple[Array, Array]:
        """Pressure in MPa, and its slope by depth in MPa/mm, at distances of any shape."""
        s, d, k = np.maximum(-gap, 0.0), self.depth_mm, self.stiffness
        return np.where(s < d, k * s**2 / (2 * d), k * (s - d / 2)), np.where(s < d, k * s / d, k)

    def _lagged(self, memory: Memory, gap: Array, normal: Array) -> Lag:
        return Lag(self._pressure(gap)[0], normal, friction.met(memory.gap, gap))

    def _of(self, face: Array) -> tuple[Memory, Lag]:
        """Memory and lag of some faces."""
        m, lag = self.memory, self.lag
        place, gap, normal, pressure, slip, slid = (
            a[face] for a in (m.place, m.gap, m.normal, m.pressure, m.slip, m.slid)
        )
        memory = Memory(place, gap, normal, pressure, slip, slid)
        return memory, Lag(lag.pressure[face], lag.normal[face], lag.counts[face])

    def _tractions(self, y: Array, memory: Memory, lag: Lag) -> Array:
        """Friction (f, q, 3) in MPa at places in the obstacle's frame."""
        e = friction.slip(memory, lag, y)
        return friction.traction(e, self.friction * lag.pressure, self.stick_stiffness)


def _subdivided(points: Array, weight: Array, halvings: int) -> tuple[Array, Array]:
    """A triangle's quadrature, barycentric points (q, 3) and weights (q,), on its 4^halvings equal pieces."""
    pieces = np.eye(3)[None]
    for _ in range(halvings):
        a, b, c = pieces[:, 0], pieces[:, 1], pieces[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab))
        pieces = np.concatenate([np.stack(t, axis=1) for t in corners])
    return (points @ pieces).reshape(-1, 3), np.tile(weight, len(pieces)) / len(pieces)

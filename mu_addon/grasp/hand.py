"""One finger of a gripper that closes on a cube, holds, lifts and releases it, with friction.

Gripper and cube are symmetric about the middle plane, and the unit about x = 0, so half of one finger and the
rigid cube are modelled. The base is clamped. The plate's compliance, the fingers' weight and the air between
them are neglected. The gripper hangs, tips down: gravity pulls along +z.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from ..arrays import Array
from ..design.anchors import anchor_points
from ..design.gripper import Gripper
from ..errors import ConvergenceError, InputError
from ..fem.bending_angle import TipSection
from ..fem.equilibrium import Equilibrium
from ..fem.kinematics import probe
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.newton_settings import CONTACT_NEWTON, NewtonSettings
from ..fem.obstacle import Obstacle
from ..fem.outer_faces import OuterFaces, outer_faces
from ..fem.rigid import Box, Pose
from ..fem.self_contact import SelfContact
from ..fem.state import State
from ..fem.time_stepping import simulate_in_time
from ..meshing.mesh import Mesh
from .phases import WORDS, Phases
from .settings import STEP_S, Contact, Cube

# Halves of fingers that touch one cube.
HALVES = 4
# Distance below its place, in sides, from which a cube comes.
COMES_FROM = 1.5
# The balance of weight and friction is found to this share of the weight, with so many tries.
BALANCE = 1e-3
MOST_SECANTS = 8
# Steps in mm by which a cube is pulled out of the grasp, and how far at most.
PULL_STEP_MM = 1.0
PULL_MOST_MM = 10.0


@attrs.frozen(eq=False)
class Lift:
    """A cube without support in the closed grasp.

    held: True if friction carries the weight; sag_mm: displacement at that balance, else nan. normal_N: of
    one finger on the cube, at the plateau. pull_mm (p,) and pull_N (p,): displacement and force of both
    fingers when the cube is pulled down.
    """

    held: bool
    sag_mm: float
    weight_N: float
    normal_N: float
    friction: float
    pull_mm: Array
    pull_N: Array

    @property
    def capacity_N(self) -> float:
        """Largest weight that friction carries, found by pulling."""
        return float(self.pull_N.max(initial=0.0))

    @property
    def margin(self) -> float:
        """Ratio of the largest friction, found by pulling, to the weight."""
        return self.capacity_N / self.weight_N

    @property
    def margin_by_rule(self) -> float:
        """2 mu N over the weight, with N of one finger at the plateau."""
        return 2.0 * self.friction * self.normal_N / self.weight_N


@attrs.frozen(eq=False)
class Grasp:
    """A grasp of one cube at k instants; forces are those of one whole finger on the cube.

    u (k, n, 3): displacement of the half mesh in mm; backbone (k, p, 3): the anchors, in the finger's frame;
    cube_mm (k, 3): the cube's middle in that frame. normal_N (k,): toward the other finger; down_N (k,):
    along +z, friction except for the pressure of edges. sticking (k,): share of the contact area that does
    not slide; slid_mm (k,): largest slip of a point so far; deepest_mm (k,): the error of the gap; lost_mJ
    (k,): dissipated by friction, of one finger; volume_mm3 (k,): of its cavity; snapped_mm (k,): largest
    displacement of a node in a snap before an instant, else 0.
    """

    cube: Cube
    time_s: Array
    pressure_kPa: Array
    phase: tuple[str, ...]
    angle_deg: Array
    normal_N: Array
    down_N: Array
    area_mm2: Array
    sticking: Array
    slid_mm: Array
    deepest_mm: Array
    lost_mJ: Array
    volume_mm3: Array
    snapped_mm: Array
    cube_mm: Array
    backbone: Array
    u: Array
    lift: Lift

    @property
    def pressure_work_mJ(self) -> float:
        """Work of the pressure on one finger over the whole cycle, by the trapezoidal rule."""
        rise = np.diff(self.volume_mm3)
        return float(((self.pressure_kPa[1:] + self.pressure_kPa[:-1]) / 2e3 * rise).sum())

    @property
    def cube_work_mJ(self) -> float:
        """Work of the cube's motion on one finger over the whole cycle, by the trapezoidal rule."""
        way = np.diff(self.cube_mm[:, 2])
        return -float(((self.down_N[1:] + self.down_N[:-1]) / 2.0 * way).sum())

    def end(self, phase: str) -> int:
        """Number of a phase's last instant."""
        return max(i for i, name in enumerate(self.phase) if name == phase)


def place_of(gripper: Gripper, contact: Contact) -> Array:
    """The cube's middle (3,) in mm in a finger's frame, once it is between the tips."""
    d = gripper.unit.dimensions
    return np.array([0.0, gripper.axis_mm, d.height + contact.beyond_mm])


def obstacle_of(gripper: Gripper, cube: Cube, contact: Contact, mesh: Mesh) -> Obstacle:
    """The cube between the tips as an obstacle of a finger; raises InputError where it does not fit."""
    if cube.side_mm >= gripper.fingers.gap_mm:
        raise InputError(
            f"a cube of {cube.side_mm:g} mm does not fit between fingers {gripper.fingers.gap_mm:g} mm apart",
            "--cube",
            "choose a smaller cube, or a gripper with a wider gap",
        )
    return Obstacle(
        mesh,
        Box(np.zeros(3), np.full(3, cube.side_mm / 2.0)),
        contact.pressure_MPa,
        contact.depth_mm,
        contact.halvings,
        contact.friction,
        contact.stick_mm,
        pose=Pose(shift=place_of(gripper, contact)),
        faces=_facing(gripper, mesh),
    )


def _facing(gripper: Gripper, mesh: Mesh) -> OuterFaces:
    """Faces of a finger that can meet the cube: on its inner side and tip, to the depth of open struts."""
    faces = outer_faces(mesh)
    (_, inner), (_, tip) = gripper.unit.printed.bounds[1:]
    y, z = mesh.nodes[faces.nodes[:, :3]][:, :, 1], mesh.nodes[faces.nodes[:, :3]][:, :, 2]
    near = gripper.unit.printed.cell
    return faces.of((y > inner - near).all(axis=1) | (z > tip - near).all(axis=1))


def grasp(
    gripper: Gripper,
    cube: Cube,
    phases: Phases,
    mesh: Mesh,
    materials: Materials,
    contact: Contact | None = None,
    step_s: float = STEP_S,
    threads: int = 1,
    on_instant: Callable[[float, str], None] = lambda share, words: None,
    newton: NewtonSettings = CONTACT_NEWTON,
    self_contact: SelfContact | None = None,
) -> Grasp:
    """Close a finger on a cube phase by phase, in time order, and lift the cube.

    mesh and materials: of the gripper's unit, the half mesh. step_s: longest interval between instants.
    on_instant: called with the share done. newton: settings for the mesh; self_contact: of the finger's
    parts. Raises InputError for a cube that does not fit, ConvergenceError where an instant has no
    equilibrium.
    """
    contact = contact or Contact()
    model = Model(mesh, threads=threads)
    model.self_contact = self_contact
    equilibrium = Equilibrium(model, materials, newton)
    return _Hand(gripper, cube, phases, equilibrium, contact, step_s, on_instant).work()


class _Hand:
    """State of a grasp: the finger, the cube, and the cube's pose."""

    def __init__(
        self,
        gripper: Gripper,
        cube: Cube,
        phases: Phases,
        equilibrium: Equilibrium,
        contact: Contact,
        step_s: float,
        on_instant: Callable[[float, str], None],
    ) -> None:
        mesh = equilibrium.model.mesh
        self.cube, self.contact, self.phases, self.mesh = cube, contact, phases, mesh
        self.anchors = anchor_points(gripper.unit)
        self.tip = TipSection.of(mesh)
        self.place = place_of(gripper, contact)
        self.obstacle = obstacle_of(gripper, cube, contact, mesh)
        self.obstacle.path = self.pose
        self.equilibrium = equilibrium
        equilibrium.model.obstacles = (self.obstacle,)
        self.time, self.pressure, self.phase = phases.sample(step_s)
        self.on_instant = on_instant
        self.sunk = 0.0
        self.lift: Lift | None = None
        self.rows: list[tuple[float, ...]] = []
        self.at: list[Array] = []

    def pose(self, time_s: float) -> Pose:
        """Pose of the cube: it rises from below while the fingers open, and sags as it is lifted.

        A cube that friction cannot carry stays on its support: its fall is not followed.
        """
        begun, there = self.phases.span("i")
        way = COMES_FROM * self.cube.side_mm
        away = way * np.clip((there - time_s) / (there - begun), 0.0, 1.0)
        start, end = self.phases.span("iv")
        sinking = self.sunk * np.clip((time_s - start) / (end - start), 0.0, 1.0)
        return Pose(shift=self.place + np.array([0.0, 0.0, away + sinking]))

    def work(self) -> Grasp:
        found = simulate_in_time(self.equilibrium, self.time, self.pressure, self._reached)
        assert self.lift is not None
        columns = np.array(self.rows).T
        u = np.array([state.u for state in found.states])
        points = self.anchors
        monitor = probe(self.mesh, points)
        return Grasp(
            cube=self.cube,
            time_s=self.time,
            pressure_kPa=self.pressure,
            phase=self.phase,
            angle_deg=columns[0],
            normal_N=columns[1],
            down_N=columns[2],
            area_mm2=columns[3],
            sticking=columns[4],
            slid_mm=columns[5],
            deepest_mm=columns[6],
            lost_mJ=columns[7],
            volume_mm3=columns[8],
            snapped_mm=columns[9],
            cube_mm=np.array(self.at),
            backbone=np.array([points + monitor.displacement(one) for one in u]),
            u=u,
            lift=self.lift,
        )

    def _reached(self, state: State) -> None:
        """Keep an instant's results; at the end of holding, find how the cube hangs."""
        number = len(self.rows)
        contact = self.obstacle.contact(state.u)
        self.rows.append(
            (
                self.tip.angle_deg(state.u),
                2.0 * float(contact.normal_N[1]),
                2.0 * float(contact.force_N[2]),
                2.0 * contact.area_mm2,
                contact.sticking,
                float(contact.slid_mm.max(initial=0.0)),
                contact.deepest_mm,
                2.0 * contact.lost_mJ,
                2.0 * self.equilibrium.model.cavity_volume(state.u),
                state.snapped_mm,
            )
        )
        self.at.append(self.obstacle.pose.shift)
        phase = self.phase[number]
        words = f"{WORDS.get(phase, phase)}, {self.pressure[number]:g} kPa"
        self.on_instant((number + 1) / len(self.time), words + (", touching" if contact.area_mm2 else ""))
        last_of_hold = max(i for i, name in enumerate(self.phase) if name == "iii")
        if number == last_of_hold:
            self.lift = lifted(self.equilibrium, self.obstacle, state, self.cube, self.contact.friction)
            self.sunk = self.lift.sag_mm if self.lift.held else 0.0


def lifted(equilibrium: Equilibrium, obstacle: Obstacle, state: State, cube: Cube, friction: float) -> Lift:
    """Position of a cube in a closed grasp without support: where friction balances its weight.

    state: converged and committed. The cube is pulled down step by step with accumulating slip, until the
    friction stops growing or drops. The balance with the weight is then found to within `BALANCE`. The
    obstacle is restored.
    """
    normal = 2.0 * float(obstacle.contact(state.u).normal_N[1])
    if not obstacle.friction:
        none = np.zeros(1)
        return Lift(False, float("nan"), cube.weight_N, normal, friction, none, none)
    pose, memories, states = obstacle.pose, [obstacle.memory], [state]

    def carried(start: State, way: float) -> tuple[State, float]:
        """State with the cube lowered by so many mm, and the upward force on it in N."""
        obstacle.pose = Pose(pose.rotation, pose.shift + np.array([0.0, 0.0, way]))
        found = equilibrium.newton(start.u, state.pressure_MPa)
        return found, -HALVES * float(obstacle.force_N(found.u)[2])

    pulls = [(0.0, -HALVES * float(obstacle.force_N(state.u)[2]))]
    try:
        while pulls[-1][0] < PULL_MOST_MM - 1e-9 and not _fallen([force for _, force in pulls]):
            way = pulls[-1][0] + PULL_STEP_MM
            try:
                found, force = carried(states[-1], way)
            except ConvergenceError:
                # The tips snap off the cube: their load until then is the capacity.
                break
            obstacle.commit(found.u)
            pulls.append((way, force))
            states.append(found)
            memories.append(obstacle.memory)
        number = next((k for k, (_, force) in enumerate(pulls) if force >= cube.weight_N), None)
        sag = float("nan") if number is None else 0.0
        if number:
            (low, below), (high, above) = pulls[number - 1 : number + 1]
            for _ in range(MOST_SECANTS):
                sag = low + (cube.weight_N - below) * (high - low) / (above - below)
                obstacle.recall(memories[number - 1])
                force = carried(states[number - 1], sag)[1]
                if abs(force - cube.weight_N) <= BALANCE * cube.weight_N:
                    break
                low, below, high, above = (
                    (sag, force, high, above) if force < cube.weight_N else (low, below, sag, force)
                )
    finally:
        obstacle.pose = pose
        obstacle.recall(memories[0])
    way, force = np.array(pulls).T
    return Lift(number is not None, sag, cube.weight_N, normal, friction, way, force)


def _fallen(force: list[float]) -> bool:
    """Return True if a force has passed its peak by more than its fluctuation."""
    return len(force) > 2 and force[-1] > 0 and force[-1] < 0.98 * max(force)

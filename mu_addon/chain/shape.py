"""The whole of a chain for display: meshes of its units, one on the other, and where they are in a state."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..meshing.mesh import Mesh
from .chain import ChainState
from .joint_learning import Learned
from .unit_between_plates import frame, spread


@attrs.frozen(eq=False)
class Shape:
    """Units of a chain, from the base on: turns in degrees, meshes and joints."""

    turns_deg: tuple[float, ...]
    meshes: tuple[Mesh, ...]
    learned: tuple[Learned, ...]

    def mesh(self) -> Mesh:
        """Meshes of all units stacked as drawn; they share no nodes."""
        nodes, tets, region, first, height = [], [], [], 0, 0.0
        for turn, mesh in zip(self.turns_deg, self.meshes, strict=True):
            nodes.append(mesh.nodes @ frame(turn)[:3, :3].T + [0.0, 0.0, height])
            tets.append(mesh.tets + first)
            region.append(mesh.region)
            first += len(mesh.nodes)
            height += float(mesh.nodes[mesh.tip[0], 2])
        empty = np.zeros((0, 6))
        last = first - len(self.meshes[-1].nodes) + self.meshes[-1].tip
        return Mesh(
            np.concatenate(nodes),
            np.concatenate(tets),
            np.concatenate(region),
            empty,
            self.meshes[0].base,
            last,
        )

    def places(self, state: ChainState) -> Array:
        """Positions (m, 3) in mm of the nodes of `mesh` in a state of the chain.

        A unit's free states about its pressure, advanced by the constant strain between its plates: exact on
        the plates, approximate between them.
        """
        found = []
        parts = zip(self.turns_deg, self.meshes, self.learned, state.plates, strict=False)
        for i, (turn, mesh, learned, base) in enumerate(parts):
            joint = learned.joint
            p = float(state.pressures_kPa[i])
            number = np.interp(p, joint.pressure_kPa, np.arange(len(joint.pressure_kPa)))
            k = min(int(number), max(len(joint.pressure_kPa) - 2, 0))
            share = number - k
            station = np.clip(mesh.nodes[:, 2] / float(mesh.nodes[mesh.tip[0], 2]), 0.0, 1.0)
            # Each brought to the plates of the state: of two apart, a mean would shrink what turns.
            u = sum(
                weight * spread(mesh, learned.free_u[n], station, joint.eta0[n], state.eta[i])
                for n, weight in ((k, 1 - share), (k + 1, share))
                if weight
            )
            x = mesh.nodes + u
            own = base @ frame(turn)
            found.append(x @ own[:3, :3].T + own[:3, 3])
        return np.concatenate(found)

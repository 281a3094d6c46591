"""Kinds of lattice beside the shipped ones."""

from itertools import product

import numpy as np

from mu_addon.design.lattice_kinds import LatticeKind, constant

CORNERS = list(product((0.0, 1.0), repeat=3))


def between(nodes, length):
    """Struts of one length between nodes in cells."""
    return [
        (a, b)
        for a in range(len(nodes))
        for b in range(a)
        if abs(np.linalg.norm(np.subtract(nodes[a], nodes[b])) - length) < 1e-9
    ]


def simple_cubic(name="simple-cubic"):
    """Struts along the edges, each shared by four cells; no node inside."""
    return LatticeKind(name, CORNERS, between(CORNERS, 1.0), constant)


def octet(name="octet"):
    """The octet truss: face-centred nodes, each joined to its twelve neighbours."""
    faces = [[0.5 + 0.5 * s * (axis == k) for k in range(3)] for axis in range(3) for s in (-1, 1)]
    nodes = [*CORNERS, *faces]
    return LatticeKind(name, nodes, between(nodes, np.sqrt(0.5)), constant)


def thirds(name="thirds"):
    """Struts along the edges, each in three: nodes at fractions that floats do not hold."""
    nodes = sorted(
        {
            tuple(np.roll((k / 3, *corner), axis))
            for k in range(4)
            for axis in range(3)
            for corner in product((0.0, 1.0), repeat=2)
        }
    )
    return LatticeKind(name, nodes, between(nodes, 1 / 3), constant)

"""Kinds of lattice: the shipped ones, and others."""

from itertools import product

import numpy as np

from mu_addon.design.lattice_kinds import LatticeKind, constant, kind, text_of

BODY_CENTRED, STRAIGHT = kind("body-centred"), kind("body-centred-straight")
CORNERS = list(product((0.0, 1.0), repeat=3))
FACES = [(0, 0.5, 0.5), (1, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 1, 0.5), (0.5, 0.5, 0), (0.5, 0.5, 1)]


def custom(kind):
    """The parameters of a unit whose lattice is of this kind."""
    return {"kind": "custom", "struts": text_of(kind)}


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


def cross(name="cross"):
    """Struts along the axes through the cell's centre."""
    return LatticeKind(name, [(0.5, 0.5, 0.5), *FACES], [(0, k) for k in range(1, 7)], constant)


def octet(name="octet"):
    """The octet truss: face-centred nodes, each joined to its twelve neighbours."""
    nodes = [*CORNERS, *FACES]
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

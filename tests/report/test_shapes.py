"""Markers are closed, outward surfaces of the size asked for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.surface import volume
from mu_addon.report.shapes import ball, tube


def edge_count(faces):
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def test_ball():
    vertices, faces = ball((1, 2, 3), 2.0, 64)
    assert np.linalg.norm(vertices - [1, 2, 3], axis=1) == pytest.approx(2.0, abs=5e-3)
    assert volume(vertices, faces) == pytest.approx(4 / 3 * np.pi * 8, rel=1e-2)


steps = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda s: np.linalg.norm(s) > 0.2)


@settings(max_examples=40)
@given(st.lists(steps, min_size=1, max_size=6))
def test_tube_is_outward_and_closed_along_any_line(moves):
    directions = np.array(moves)
    # Turns sharper than a right angle fold any tube.
    for i in range(1, len(directions)):
        if directions[i] @ directions[i - 1] < 0:
            directions[i] *= -1
    points = np.vstack([[0, 0, 0], np.cumsum(directions, axis=0)]) * 10
    vertices, faces = tube(points, 0.5, 12)
    # Only the two rings of no radius at the ends are open, and they are points.
    assert (edge_count(faces) <= 2).all()
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    section = 0.5 * 12 * 0.25 * np.sin(2 * np.pi / 12)
    assert 0.5 * section * length < volume(vertices, faces) < 1.05 * (section * length + 0.53)

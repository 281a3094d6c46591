"""Which solver and device a body gets."""

import pytest
import warp as wp

from mu_addon.errors import InputError
from mu_addon.fem import linear_solver
from mu_addon.fem.linear_solver import SolverChoice, factor_bytes

from .bodies import hollow_box

QUADRATIC, LINEAR = hollow_box(n=2), hollow_box(n=2, order=1)


def test_a_body_that_fits_into_memory_is_factorised_on_the_cpu(monkeypatch):
    monkeypatch.setattr(linear_solver, "cuda_devices", lambda: ["cuda:0"])
    for mesh in (QUADRATIC, LINEAR):
        assert SolverChoice().resolved(mesh) == ("cpu", "factorisation")
        assert SolverChoice("direct", "cpu").resolved(mesh) == ("cpu", "factorisation")
    assert SolverChoice("iterative").resolved(QUADRATIC) == ("cpu", "two levels")


def test_what_does_not_fit_is_solved_by_two_levels_unless_a_factor_is_needed(monkeypatch):
    monkeypatch.setattr(linear_solver, "free_memory_bytes", lambda: 1.0)
    assert SolverChoice().resolved(QUADRATIC) == ("cpu", "two levels")
    assert SolverChoice().resolved(QUADRATIC, needs_factor=True) == ("cpu", "factorisation")
    assert SolverChoice().resolved(LINEAR) == ("cpu", "factorisation")
    assert SolverChoice("direct").resolved(QUADRATIC) == ("cpu", "factorisation")
    monkeypatch.setattr(linear_solver, "free_memory_bytes", lambda: None)
    assert SolverChoice().resolved(QUADRATIC) == ("cpu", "factorisation")
    assert factor_bytes(435_819) == pytest.approx(6.26e9)


def test_a_cuda_device_is_taken_where_it_is_there_and_pays(monkeypatch):
    monkeypatch.setattr(linear_solver, "CUDA_PAYS", 1)
    monkeypatch.setattr(linear_solver, "cuda_devices", list)
    assert SolverChoice().resolved(QUADRATIC) == ("cpu", "factorisation")
    monkeypatch.setattr(linear_solver, "cuda_devices", lambda: ["cuda:0"])
    assert SolverChoice().resolved(QUADRATIC) == ("cuda:0", "conjugate gradients")
    assert SolverChoice("direct").resolved(QUADRATIC) == ("cpu", "factorisation")
    assert SolverChoice("direct", "cuda:0").resolved(QUADRATIC) == ("cuda:0", "factorisation")
    assert SolverChoice("iterative", "cuda:0").resolved(LINEAR) == ("cuda:0", "conjugate gradients")
    with pytest.raises(InputError, match="no device cuda:1") as caught:
        SolverChoice(device="cuda:1").resolved(QUADRATIC)
    assert "it sees cuda:0" in caught.value.remedy


def test_names_that_are_not_known_are_refused():
    with pytest.raises(InputError, match="solver = 'multigrid' is not known"):
        SolverChoice("multigrid")
    with pytest.raises(InputError, match="no device 'gpu'"):
        SolverChoice(device="gpu")
    if not wp.get_cuda_devices():
        with pytest.raises(InputError, match="sees no device cuda:0"):
            SolverChoice(device="cuda:0").require_device()


def test_a_warp_without_cuda_says_where_it_is(monkeypatch):
    monkeypatch.setattr(linear_solver, "cuda_devices", list)
    for version, remedy in ((None, "archive that ends in -cuda"), ((13, 4), "NVIDIA's driver")):
        monkeypatch.setattr(wp, "get_cuda_toolkit_version", lambda version=version: version)
        with pytest.raises(InputError) as caught:
            SolverChoice(device="cuda:0").require_device()
        assert remedy in caught.value.remedy


def test_free_memory_is_known_or_not_asked_for():
    assert linear_solver.free_memory_bytes() is None or linear_solver.free_memory_bytes() > 0

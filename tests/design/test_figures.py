"""Size, resin and print time of a unit."""

import pytest

from mu_addon.design.figures import estimated_volume, figures, print_time
from mu_addon.design.parameters import load_preset
from mu_addon.design.printing.printer import load_printer
from mu_addon.design.solid import build_solid
from mu_addon.design.steps import Stack, StepInputs


def struts_of(unit):
    return Stack().value("struts", StepInputs(unit))


def test_the_estimate_is_that_of_the_printable_solid():
    unit = load_preset("mu-0.75x")
    solid = build_solid(unit, None)
    assert estimated_volume(unit, struts_of(unit)) / solid.gates.volume_mm3 == pytest.approx(1.02, abs=0.01)
    size = solid.vertices.max(axis=0) - solid.vertices.min(axis=0)
    printer = load_printer()
    found = figures(unit, printer, struts_of(unit), solid.gates.volume_mm3)
    assert found.size_mm == pytest.approx(tuple(size), abs=1e-3)
    assert not found.approximate
    assert found.mass_g == pytest.approx(solid.gates.volume_mm3 / 1000.0 * printer["density_g_per_ml"])


def test_twice_the_scale_is_eight_times_the_resin():
    one, two = load_preset("mu-0.75x"), load_preset("mu-1.5x")
    small, large = (figures(unit, load_printer(), struts_of(unit)) for unit in (one, two))
    assert large.volume_mm3 == pytest.approx(8.0 * small.volume_mm3, rel=1e-6)
    assert large.approximate


def test_time_is_layers_times_the_time_of_one():
    printer = load_printer()
    layers = (81.0 + printer["support_mm"]) / printer["layer_mm"]
    assert print_time(81.0, printer) == pytest.approx(layers * printer["layer_s"])
    assert printer.limits["layer_s"].assumed

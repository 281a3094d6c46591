"""Examples in docstrings run as they stand."""

import doctest
import importlib
import pkgutil

import pytest

PACKAGES = (
    "chain",
    "design",
    "evidence",
    "fem",
    "homogenize",
    "materials",
    "measured",
    "meshing",
    "optimization",
    "placement",
    "body",
    "sensing",
)


@pytest.mark.parametrize("package", PACKAGES)
def test_examples_give_what_they_show(package):
    face = importlib.import_module(f"mu_addon.{package}")
    names = [found.name for found in pkgutil.walk_packages(face.__path__, f"{face.__name__}.")]
    for name in [face.__name__, *names]:
        failed, _ = doctest.testmod(importlib.import_module(name))
        assert failed == 0, name

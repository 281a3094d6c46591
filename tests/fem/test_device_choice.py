"""Devices that are asked for, and what is said where there is none of them."""

import pytest
import warp as wp

from mu_addon.errors import InputError
from mu_addon.fem import device
from mu_addon.fem.device import require_device


def test_a_device_that_is_not_there_is_refused_with_those_that_are(monkeypatch):
    require_device("cpu")
    monkeypatch.setattr(device, "cuda_devices", lambda: ["cuda:0"])
    require_device("cuda:0")
    with pytest.raises(InputError, match="no device cuda:1") as caught:
        require_device("cuda:1")
    assert "it sees cuda:0" in caught.value.remedy


def test_a_warp_without_cuda_says_where_it_is(monkeypatch):
    monkeypatch.setattr(device, "cuda_devices", list)
    for version, remedy in ((None, "archive that ends in -cuda"), ((13, 4), "NVIDIA's driver")):
        monkeypatch.setattr(wp, "get_cuda_toolkit_version", lambda version=version: version)
        with pytest.raises(InputError) as caught:
            require_device("cuda:0")
        assert remedy in caught.value.remedy

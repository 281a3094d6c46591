"""Device of the finite elements: the processor, or a CUDA device that Warp sees."""

from __future__ import annotations

import re
from typing import Any

import attrs

from ..design.quantity import described
from ..design.settings import SOLVER
from ..errors import InputError


def known_device(_: object, field: attrs.Attribute[Any], value: str) -> None:
    """Validator of an attrs field for a device; raises InputError for an unknown name."""
    if not isinstance(value, str) or not re.fullmatch(r"cpu|cuda:\d+", value):
        raise InputError(f"there is no device {value!r}", f"--{field.name}", "give cpu or cuda:0")


DEVICE = described(
    "device",
    "cpu",
    "device of the finite elements: cpu, by factorisation, or a CUDA device, by conjugate gradients",
    group=SOLVER,
)


def require_device(device: str) -> None:
    """Raise InputError where a CUDA device is asked for and Warp sees none of that name."""
    if not device.startswith("cuda"):
        return
    seen = cuda_devices()
    if device not in seen:
        raise InputError(
            f"Warp sees no device {device} on this machine",
            "--device",
            f"it sees {', '.join(seen)}" if seen else _without_cuda(),
        )


def _without_cuda() -> str:
    """Remedy where Warp sees no CUDA device."""
    import warp as wp

    if wp.get_cuda_toolkit_version() is None:
        return "give cpu; this Warp is built without CUDA: install the extension's archive that ends in -cuda"
    return "give cpu; for CUDA install NVIDIA's driver"


def cuda_devices() -> list[str]:
    """Warp's names of the CUDA devices it sees."""
    import warp as wp

    return [str(device) for device in wp.get_cuda_devices()]

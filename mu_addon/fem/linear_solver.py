"""Choice of linear solver and device for a body: as asked for, or by size and memory."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING

import attrs

from ..design.quantity import described
from ..errors import InputError

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh

# At so many unknowns a factorisation on the CPU takes 8 s, a load step 12 (docs/engineering/performance.md);
# below it an iterative solution on a device has little to win, above it that much. Reckoned, not measured.
CUDA_PAYS = 200_000
SOLVER = described(
    "solver",
    "auto",
    "solver of linear systems: a factorisation, or conjugate gradients on two levels of elements. auto: "
    "direct, unless the factor does not fit into memory",
    choices=("auto", "direct", "iterative"),
)
DEVICE = described(
    "device",
    "auto",
    f"device for the finite elements. auto: a CUDA device if there is one and the mesh has {CUDA_PAYS:_} "
    "unknowns or more, otherwise the CPU".replace("_", " "),
)
# Measured peak of a quadratic body's factorisation: 6.26 GB at 435 819 unknowns, to the power 0.93 of them.
_PEAK_BYTES, _PEAK_UNKNOWNS, _PEAK_POWER = 6.26e9, 435_819, 0.93

FACTORISATION, TWO_LEVELS, GRADIENTS = "factorisation", "two levels", "conjugate gradients"


@attrs.frozen
class SolverChoice:
    """Name of the linear solver, and Warp's name of a device; results differ only by the solver's tolerance.

    auto: the CPU's factorisation, whose digits do not change with the machine; two levels of conjugate
    gradients where a factor of quadratic elements does not fit into free memory and `needs_factor` is not
    set; a CUDA device where Warp sees one and the body has CUDA_PAYS unknowns. Raises InputError for a name
    that is not known.
    """

    method: str = SOLVER.field()
    device: str = DEVICE.field()

    def __attrs_post_init__(self) -> None:
        if not re.fullmatch(r"auto|cpu|cuda:\d+", self.device):
            raise InputError(f"there is no device {self.device!r}", "--device", "give auto, cpu or cuda:0")

    def require_device(self) -> None:
        """Raise InputError where a CUDA device is asked for and Warp sees none of that name."""
        if not self.device.startswith("cuda"):
            return
        seen = cuda_devices()
        if self.device not in seen:
            raise InputError(
                f"Warp sees no device {self.device} on this machine",
                "--device",
                f"it sees {', '.join(seen)}" if seen else _without_cuda(),
            )

    def resolved(self, mesh: Mesh, needs_factor: bool = False) -> tuple[str, str]:
        """Device and solver of a mesh, as `Model` takes them: names such as ("cpu", "factorisation").

        needs_factor: whether a job asks for a factor besides solutions, as the ranking of paths does. Raises
        InputError as `require_device`.
        """
        self.require_device()
        unknowns = 3 * len(mesh.nodes)
        device = self.device
        if device == "auto":
            pays = unknowns >= CUDA_PAYS and self.method != "direct"
            device = next(iter(cuda_devices()), "cpu") if pays else "cpu"
        if device != "cpu":
            return device, FACTORISATION if self.method == "direct" else GRADIENTS
        iterative = self.method == "iterative"
        if self.method == "auto" and mesh.order == 2 and not needs_factor:
            free = free_memory_bytes()
            iterative = free is not None and factor_bytes(unknowns) > free
        return device, TWO_LEVELS if iterative else FACTORISATION


def factor_bytes(unknowns: int) -> float:
    """Peak memory in bytes of a quadratic body's factorisation: 6.26e9 (unknowns/435 819)^0.93, measured."""
    return float(_PEAK_BYTES * (unknowns / _PEAK_UNKNOWNS) ** _PEAK_POWER)


def free_memory_bytes() -> float | None:
    """Memory in bytes still available to a process, or None where the system does not report it."""
    try:
        with open("/proc/meminfo", encoding="ascii") as stream:
            found = re.search(r"^MemAvailable:\s+(\d+) kB", stream.read(), re.MULTILINE)
        return 1024.0 * int(found[1]) if found else None
    except OSError:
        pass
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


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

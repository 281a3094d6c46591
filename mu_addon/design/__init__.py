"""Design: the parameters of a Monolithic Unit, and the exact geometry that follows from them.

Start with `load_preset` or `read_unit`, which give a `Unit`: every parameter with its unit, bounds and
source. `Unit.dimensions` are its true lengths in mm. `build_solid` makes the printable surface, `write_stl`
its file; `anchor_points` and `windows` are the nodes and paths that a waveguide can follow.

    >>> from mu_addon.design import load_preset, windows
    >>> unit = load_preset("mu-1.0x")
    >>> unit.dimensions.height, len(windows(6))
    (75.0, 10)
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .anchors import Window, anchor_points, window, windows
    from .body import Body, read_body
    from .dimensions import Dimensions
    from .gates import GateError
    from .gripper import Gripper, GripperSolid, build_gripper, load_gripper, read_gripper
    from .lattice_kinds import LatticeKind
    from .parameters import (
        Unit,
        assumed,
        from_toml,
        load_preset,
        preset_names,
        read_unit,
        to_toml,
        write_unit,
    )
    from .printing.check import PrintCheck, check
    from .printing.limit_parts import limit_parts
    from .printing.orientation import direction_name
    from .printing.printer import MEANING, Printer, load_printer, printer_text, read_printer
    from .printing.repair import Repair, repaired
    from .printing.slices import even_heights, has_volume, slices
    from .printing.vents import Vented, vented
    from .profile import cavity_radius, cavity_volume, membrane_volume, outer_radius
    from .quantity import in_kPa, in_MPa
    from .rigid_body import RigidBody
    from .solid import Solid, build_solid, chamber
    from .stl_and_nodes import write_nodes, write_stl
    from .strut_cell import StrutCell
    from .surface import stl_bytes
    from .threemf import write_3mf
else:
    __getattr__, __dir__, __all__ = public_face(__name__)

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
    from .anchors import Window as Window
    from .anchors import anchor_points as anchor_points
    from .anchors import window as window
    from .anchors import windows as windows
    from .body import Body as Body
    from .body import read_body as read_body
    from .dimensions import Dimensions as Dimensions
    from .gates import GateError as GateError
    from .gripper import Gripper as Gripper
    from .gripper import GripperSolid as GripperSolid
    from .gripper import build_gripper as build_gripper
    from .gripper import load_gripper as load_gripper
    from .gripper import read_gripper as read_gripper
    from .lattice_kinds import LatticeKind as LatticeKind
    from .parameters import Unit as Unit
    from .parameters import assumed as assumed
    from .parameters import from_toml as from_toml
    from .parameters import load_preset as load_preset
    from .parameters import preset_names as preset_names
    from .parameters import read_unit as read_unit
    from .parameters import to_toml as to_toml
    from .parameters import write_unit as write_unit
    from .printing.check import PrintCheck as PrintCheck
    from .printing.check import check as check
    from .printing.limit_parts import limit_parts as limit_parts
    from .printing.orientation import direction_name as direction_name
    from .printing.printer import MEANING as MEANING
    from .printing.printer import Printer as Printer
    from .printing.printer import load_printer as load_printer
    from .printing.printer import printer_text as printer_text
    from .printing.printer import read_printer as read_printer
    from .printing.repair import Repair as Repair
    from .printing.repair import repaired as repaired
    from .printing.slices import even_heights as even_heights
    from .printing.slices import has_volume as has_volume
    from .printing.slices import slices as slices
    from .printing.vents import Vented as Vented
    from .printing.vents import vented as vented
    from .profile import cavity_radius as cavity_radius
    from .profile import cavity_volume as cavity_volume
    from .profile import membrane_volume as membrane_volume
    from .profile import outer_radius as outer_radius
    from .quantity import in_kPa as in_kPa
    from .quantity import in_MPa as in_MPa
    from .rigid_body import RigidBody as RigidBody
    from .solid import Solid as Solid
    from .solid import build_solid as build_solid
    from .solid import chamber as chamber
    from .stl_and_nodes import write_nodes as write_nodes
    from .stl_and_nodes import write_stl as write_stl
    from .strut_cell import StrutCell as StrutCell
    from .surface import stl_bytes as stl_bytes
    from .threemf import write_3mf as write_3mf
else:
    __getattr__, __dir__, __all__ = public_face(__name__)

"""Materials: a library with sources, coupons, and laws fitted to them."""

from .coupon import MODES, Coupon, Response, incompressible, response
from .fit import Fit, fit
from .library import Material, load_material, material_names, read_material, write_material
from .stability import Stability, stability

__all__ = [
    "MODES",
    "Coupon",
    "Fit",
    "Material",
    "Response",
    "Stability",
    "fit",
    "incompressible",
    "load_material",
    "material_names",
    "read_material",
    "response",
    "stability",
    "write_material",
]

"""Materials: a library of resins with sources, tension tests of coupons, and laws fitted to them.

>>> from mu_addon.materials import load_material, material_names
>>> len(material_names()) > 0
True
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .coupon import MODES, Coupon, Response, incompressible, response
    from .fit import FLOOR, POISSON, TOLERANCE, Fit, fit_coupons, leave_one_mode_out, ranges
    from .law_choice import Choice, choose, disagreement
    from .law_forms import FORMS, form
    from .library import Material, load_material, material_names, material_text, read_material
    from .stability import Stability, check_stability
else:
    __getattr__, __dir__, __all__ = public_face(__name__)

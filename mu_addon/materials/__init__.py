"""Materials: a library of resins with sources, tension tests of coupons, and laws fitted to them.

>>> from mu_addon.materials import load_material, material_names
>>> len(material_names()) > 0
True
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .coupon import MODES as MODES
    from .coupon import Coupon as Coupon
    from .coupon import Response as Response
    from .coupon import incompressible as incompressible
    from .coupon import response as response
    from .fit import FLOOR as FLOOR
    from .fit import POISSON as POISSON
    from .fit import TOLERANCE as TOLERANCE
    from .fit import Fit as Fit
    from .fit import fit_coupons as fit_coupons
    from .fit import leave_one_mode_out as leave_one_mode_out
    from .fit import ranges as ranges
    from .law_choice import Choice as Choice
    from .law_choice import choose as choose
    from .law_choice import disagreement as disagreement
    from .law_forms import FORMS as FORMS
    from .law_forms import form as form
    from .library import Material as Material
    from .library import load_material as load_material
    from .library import material_names as material_names
    from .library import material_text as material_text
    from .library import read_material as read_material
    from .stability import Stability as Stability
    from .stability import check_stability as check_stability
else:
    __getattr__, __dir__, __all__ = public_face(__name__)

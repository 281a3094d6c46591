"""Material laws: each gives energy, first Piola-Kirchhoff stress and tangent by F, and its valid range."""

from .cubic_shear import CubicShear
from .diagonal_stretch import DiagonalStretch
from .foam import Foam
from .hysteresis import Friction
from .law import Law
from .layered import Layered
from .mooney_rivlin import MooneyRivlin
from .neo_hooke import NeoHooke
from .ogden import Ogden
from .ogden_roxburgh import OgdenRoxburgh
from .prony import Prony
from .yeoh import Yeoh

__all__ = [
    "CubicShear",
    "DiagonalStretch",
    "Foam",
    "Friction",
    "Law",
    "Layered",
    "MooneyRivlin",
    "NeoHooke",
    "Ogden",
    "OgdenRoxburgh",
    "Prony",
    "Yeoh",
]

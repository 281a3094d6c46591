"""Material laws: each gives energy, first Piola-Kirchhoff stress and tangent by F, and its valid range."""

from .cubic import Cubic
from .cubic_shear import CubicShear
from .diagonal_stretch import DiagonalStretch
from .foam import Foam
from .friction import Friction
from .guccione import Guccione
from .law import Law
from .layered import Layered
from .mooney_rivlin import MooneyRivlin
from .neo_hooke import NeoHooke
from .ogden import Ogden
from .ogden_roxburgh import OgdenRoxburgh
from .prony import Prony
from .transversely_isotropic import TransverselyIsotropic
from .yeoh import Yeoh

__all__ = [
    "Cubic",
    "CubicShear",
    "DiagonalStretch",
    "Foam",
    "Friction",
    "Guccione",
    "Law",
    "Layered",
    "MooneyRivlin",
    "NeoHooke",
    "Ogden",
    "OgdenRoxburgh",
    "Prony",
    "TransverselyIsotropic",
    "Yeoh",
]

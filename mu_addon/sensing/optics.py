"""Optical constants of a resin.

No array library is loaded: the command line's --help reads this module.
"""

from __future__ import annotations

import attrs

from ..errors import InputError


@attrs.frozen
class Optics:
    """Optical constants of a resin at one wavelength; for Elastic 50A at 850 nm none are published.

    index, around: refractive indices of the resin and of its surroundings; attenuation_per_mm: in 1/mm, of
    the natural exponential; roughness: standard deviation of the wall's slope (no unit). The defaults are
    assumed: a silicone-like index, a tenth of the light lost per centimetre, walls of 0.1 mm layers with
    rounded steps. Raises InputError for an index outside 1 to 4 or negative losses.
    """

    index: float = 1.5
    attenuation_per_mm: float = 0.01
    roughness: float = 0.02
    around: float = 1.0

    def __attrs_post_init__(self) -> None:
        if not (self.around >= 1 and 1 <= self.index <= 4 and self.attenuation_per_mm >= 0 <= self.roughness):
            raise InputError(
                f"the optical constants are not physical: {self}",
                "optics",
                "index 1 to 4, no negative losses",
            )

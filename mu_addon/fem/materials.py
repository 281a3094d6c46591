"""Materials of a body: laws in layers, each over some elements, in parallel where they overlap."""

from __future__ import annotations

import hashlib
from typing import Any

import attrs
import numpy as np

from ..arrays import Array, float64, int32
from ..errors import InputError
from .laws import NeoHooke


@attrs.frozen(eq=False)
class Layer:
    """A material law in some elements: elements (k,), parameters (k, count) in the law's order.

    weight, a number or (k,): share of an element's volume that this law fills; laws that share an element act
    in parallel, under the same strain (Voigt). Raises InputError where the law does not admit its parameters.
    """

    law: Any
    elements: Array = attrs.field(converter=int32)
    parameters: Array = attrs.field(converter=float64)
    weight: Array = attrs.field(default=1.0, converter=float64)

    def __attrs_post_init__(self) -> None:
        k = len(self.elements)
        object.__setattr__(self, "weight", np.broadcast_to(self.weight, k))
        expected = (k, len(self.law.parameter_names))
        if self.parameters.shape != expected:
            raise InputError(
                f"{self.law.name}: parameters of shape {self.parameters.shape}, expected {expected}",
                "a layer of a body's materials",
                f"give one row an element, with {', '.join(self.law.parameter_names)}",
            )
        if len(np.unique(self.elements)) < k:
            raise InputError(f"{self.law.name}: an element is listed twice in one layer")
        self.law.valid(self.parameters)

    def of(self, kept: Array) -> Layer:
        """The layer restricted to a mask (k,) of its elements."""
        return (
            self
            if kept.all()
            else Layer(self.law, self.elements[kept], self.parameters[kept], self.weight[kept])
        )

    def kept(self, rows: Array, weight: Array) -> Layer:
        """Rows `rows` (r,) of this layer, with new weights (r,) from 0 to 1."""
        return Layer(self.law, self.elements[rows], self.parameters[rows], weight)


@attrs.frozen(eq=False)
class Materials:
    """Materials of a body: layers of laws over elements, in parallel where they share one.

    Every element needs at least one layer. `neo_hooke` covers all elements by Young's modulus in MPa and
    Poisson's ratio.

    >>> import numpy as np
    >>> from mu_addon.fem import Layer, Yeoh
    >>> rows = np.tile([0.2, -0.01, 0.001, 20.0], (8, 1))
    >>> Materials((Layer(Yeoh, np.arange(8), rows),)).layers[0].law.name
    'Yeoh'
    """

    layers: tuple[Layer, ...]

    @classmethod
    def neo_hooke(cls, modulus_MPa: Array, poisson: Array) -> Materials:
        """Neo-Hookean material in every element, of Young's moduli (m,) in MPa and Poisson's ratios (m,).

        Both are of small strain. Raises InputError where a modulus is not positive or a ratio not between -1
        and 0.5.
        """
        parameters = NeoHooke.parameters(modulus_MPa, poisson)
        return cls((Layer(NeoHooke, np.arange(len(parameters)), parameters),))

    def blended(self, share: Array, law: Any, parameters: Array) -> Materials:
        """These materials with another law in a share (m,) of each element, and their weights reduced by it.

        parameters: (m, count) or one row for all. Elements with weight 0 in a layer leave it. Raises
        InputError for a share outside 0 to 1, or parameters that the law does not admit.
        """
        share = np.asarray(share, float)
        if not ((share >= 0) & (share <= 1)).all():
            worst = share[np.argmax(np.abs(share - 0.5))]
            raise InputError(f"a share of an element is {worst:.6g}", remedy="give shares from 0 to 1")
        layers = []
        for layer in self.layers:
            weight = layer.weight * (1 - share[layer.elements])
            rows = np.flatnonzero(weight)
            if len(rows):
                layers.append(layer.kept(rows, weight[rows]))
        touched = np.flatnonzero(share)
        if len(touched):
            rows = np.broadcast_to(parameters, (len(share), len(law.parameter_names)))[touched]
            layers.append(Layer(law, touched, rows, share[touched]))
        return Materials(tuple(layers))

    def small_strain(self, count: int) -> tuple[Array, Array]:
        """Young's modulus (m,) in MPa and Poisson's ratio (m,) of a body of `count` elements at small strain.

        Of the sum of the layers' shear and bulk moduli by their weights; laws that depend on direction count
        with their mean over directions.
        """
        moduli = np.zeros((count, 2))
        for layer in self.layers:
            moduli[layer.elements] += layer.weight[:, None] * layer.law.small_strain(layer.parameters)
        mu, kappa = moduli.T
        return 9 * kappa * mu / (3 * kappa + mu), (3 * kappa - 2 * mu) / (6 * kappa + 2 * mu)

    def hash(self) -> str:
        """SHA-256 of every law's name and every array, equal only for identical materials."""
        digest = hashlib.sha256()
        for layer in self.layers:
            digest.update(repr((layer.law.name, layer.law.parameter_names, len(layer.elements))).encode())
            for array in (layer.elements, layer.parameters, layer.weight):
                digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

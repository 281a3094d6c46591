"""How much of a table is its mesh: the ten paths on many meshes that nobody would call different."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from mu_addon.design.anchors import anchor_points
from mu_addon.design.parameters import Unit
from mu_addon.errors import InputError, MuError
from mu_addon.meshing.mesh import Mesh
from mu_addon.run.cache import Cache, key

from ..inclusion_rules import RULES
from ..table.agreement import spearman
from ..table.table_column import ENDS_KPA, motion, paths
from .unstructured import Recipe, unstructured_mesh

Array = np.ndarray[Any, Any]


@attrs.frozen
class Family:
    """Meshes of one kind, by their recipe.

    absolute: elements have the recipe's millimetres at every scale, instead of growing with the unit.
    """

    name: str
    recipe: Recipe
    absolute: bool = False

    def mesh(self, unit: Unit, seed: int) -> Mesh:
        """The mesh of one seed. Raises MeshingError."""
        size = self.recipe.size_mm / (unit.scale if self.absolute else 1.0)
        return unstructured_mesh(unit, attrs.evolve(self.recipe, size_mm=size), seed)


# Linear elements: of 5 mm at 1.0x that grow with the unit, of 5 mm at every scale, of 9 mm at 1.0x.
FAMILIES = (
    Family("grown", Recipe()),
    Family("same", Recipe(), absolute=True),
    Family("coarse", Recipe(9.0)),
)


@attrs.frozen
class Draw:
    """One mesh to solve: family, unit, and seed."""

    family: Family
    unit: Unit
    seed: int

    @property
    def key(self) -> str:
        """Hash of all that decides what is found."""
        family = attrs.astuple(self.family)[1:]
        return key(family, self.unit.hash(), self.seed, ENDS_KPA)


@attrs.frozen(eq=False)
class Drawn:
    """What one mesh gave: J_hat (paths,) in mm and the volume stiffened over the sensor's, by one rule."""

    family: str
    scale: float
    rule: str
    seed: int
    J_hat: Array
    volume_ratio: float


def draws(units: Sequence[Unit], count: int) -> list[Draw]:
    """So many seeds of every family and unit, the first seed of all first; what would be alike once only."""
    found = []
    for seed in range(count):
        for family in FAMILIES:
            for unit in units:
                # At 1.0x both kinds of unstructured meshes are the same.
                if not (family.absolute and unit.scale == 1.0):
                    found.append(Draw(family, unit, seed))
    return found


def draw(one: Draw, samples_kPa: Array, cache: Cache) -> list[Drawn]:
    """Ten paths by both rules on one mesh; none where its equilibria are not found, which is kept, too."""
    kept = cache.get("draw", one.key)
    if kept is None:
        kept = _solved(one, samples_kPa)
        cache.put("draw", one.key, kept)
    if "failed" in kept:
        return []
    found = zip(RULES, kept["J_hat"], kept["volume_ratio"], strict=True)
    return [
        Drawn(one.family.name, one.unit.scale, rule, one.seed, J, float(ratio.mean()))
        for rule, J, ratio in found
    ]


def _solved(one: Draw, samples_kPa: Array) -> dict[str, Array]:
    try:
        mesh = one.family.mesh(one.unit, one.seed)
        moved = motion(one.unit, mesh, ENDS_KPA, look_for_self_intersection=False)
        found = paths(one.unit, mesh, moved, RULES, ENDS_KPA)
    except MuError as error:
        return {"failed": np.array(error.what)}
    J = [found.J_hat(rule, anchor_points(one.unit), samples_kPa) for rule in RULES]
    return {"J_hat": np.array(J), "volume_ratio": found.volume_ratio}


COLUMNS = ("family", "scale", "rule", "seed", "volume_ratio")


def to_rows(drawn: Iterable[Drawn]) -> list[tuple[Any, ...]]:
    """Rows of a CSV file with COLUMNS and a column a path."""
    return [
        (d.family, f"{d.scale:g}", d.rule, d.seed, f"{d.volume_ratio:.4g}", *(f"{J:.5g}" for J in d.J_hat))
        for d in drawn
    ]


def from_text(text: str, where: Path) -> list[Drawn]:
    """Drawn meshes from the text of a CSV file, `#` comments allowed. Raises InputError."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    try:
        _, *rows = csv.reader(io.StringIO("\n".join(lines)))
        return [
            Drawn(row[0], float(row[1]), row[2], int(row[3]), np.array(row[5:], float), float(row[4]))
            for row in rows
        ]
    except (ValueError, IndexError) as error:
        raise InputError(f"the table of meshes cannot be read: {error}", str(where), "restore it") from error


@attrs.frozen(eq=False)
class Scatter:
    """What many meshes say of one column. J_hat (meshes, paths) in mm; theirs (paths,) the paper's.

    agree (paths, paths): in how many of the meshes, as a share, two paths lie in the paper's order.
    """

    J_hat: Array
    theirs: Array
    volume_ratio: Array

    @property
    def spearman(self) -> Array:
        """Rank correlation of each mesh's column with the paper's, (meshes,)."""
        return np.asarray(spearman(self.J_hat, self.theirs))

    @property
    def agree(self) -> Array:
        """Share (paths, paths) of the meshes in which row and column lie in the paper's order."""
        ours = np.sign(self.J_hat[:, :, None] - self.J_hat[:, None, :])
        same = ours == np.sign(self.theirs[:, None] - self.theirs[None, :])
        return np.asarray(same.mean(axis=0))

    @property
    def chosen(self) -> Array:
        """In how many of the meshes, as a share, each path is the best, (paths,)."""
        best = self.J_hat.argmin(axis=1)
        return np.bincount(best, minlength=self.J_hat.shape[1]) / len(best)

    @property
    def spread(self) -> Array:
        """Standard deviation of each path's J_hat as a share of its mean, (paths,)."""
        return np.asarray(self.J_hat.std(axis=0, ddof=1) / self.J_hat.mean(axis=0))


def scatters(drawn: Sequence[Drawn], theirs: Mapping[float, Array]) -> dict[tuple[str, str, float], Scatter]:
    """By family, rule and scale, what at least two meshes say of the paper's columns by scale."""
    found = {}
    # At 1.0x the families of unstructured meshes are one.
    alike = [attrs.evolve(d, family="same") for d in drawn if d.family == "grown" and d.scale == 1.0]
    groups: dict[tuple[str, str, float], list[Drawn]] = {}
    for d in (*drawn, *alike):
        groups.setdefault((d.family, d.rule, d.scale), []).append(d)
    for group, members in groups.items():
        if len(members) > 1 and group[2] in theirs:
            J, ratio = np.array([d.J_hat for d in members]), np.array([d.volume_ratio for d in members])
            found[group] = Scatter(J, theirs[group[2]], ratio)
    return found

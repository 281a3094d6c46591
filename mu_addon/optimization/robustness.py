"""A proposed unit simulated again on a finer mesh, and its uncertainty by print and resin."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..design.body import Body, envelope
from ..design.parameters import Unit
from ..design.printing.check import check
from ..design.printing.printer import Printer
from ..design.solid import build_solid
from ..errors import MuError
from .evaluation import evaluate
from .targets import Target
from .uncertainty import SURE, Uncertainty
from .unit_body import Mechanics


@attrs.frozen(eq=False)
class Verified:
    """A proposed unit on a finer mesh.

    values (q,), and standard errors (q,) by mesh, print and resin, in the quantities' units; robust (q,):
    mask of targets met for all values within `SURE` errors, met (q,): for the value itself; why: the reason
    of a failure, else "". print_worst: of the printability check, "" without one, and its findings in words.
    """

    values: Array
    by_mesh: Array
    by_print: Array
    by_resin: Array
    met: Array
    robust: Array
    why: str = ""
    print_worst: str = ""
    print_findings: tuple[str, ...] = ()

    @property
    def error(self) -> Array:
        """Standard errors (q,) of all three together, root sum of squares."""
        return np.asarray(np.sqrt(self.by_mesh**2 + self.by_print**2 + self.by_resin**2))

    @property
    def is_robust(self) -> bool:
        """True if it meets every target robustly and, if requested, is printable."""
        return not self.why and bool(self.robust.all()) and self.print_worst != "error"


def verified(
    unit: Unit,
    coarse: Array,
    targets: Sequence[Target],
    finer: Mechanics,
    uncertainty: Uncertainty,
    printer: Printer | None = None,
) -> Verified:
    """Simulate a unit with values `coarse` (q,) on the search's mesh again on a finer mesh.

    The print's uncertainty acts to first order, by adjoint gradients on the finer mesh. The mesh's error is
    taken as the difference of the two meshes, an upper bound for a converging method. printer: the
    printability check (thickness, chambers) is run where it is given.
    """
    found = evaluate(unit, targets, (), finer, uncertainty=uncertainty)
    zero = np.zeros(len(targets))
    worst, words = ("", ()) if printer is None else _print_check(unit, printer, finer.body)
    if not found.sound:
        none = np.zeros(len(targets), bool)
        return Verified(found.values, zero, zero, zero, none, none, found.why, worst, words)
    by_mesh = np.nan_to_num(np.abs(found.values - coarse))
    by_print, by_resin = found.by_print, found.by_resin
    error = np.sqrt(by_mesh**2 + by_print**2 + by_resin**2)
    met, robust = np.ones(len(targets), bool), np.ones(len(targets), bool)
    for i, t in enumerate(targets):
        if t.kind == "printable":
            met[i] = robust[i] = worst != "error"
        elif t.goal is None:
            met[i] = t.met(found.values[i])
            robust[i] = t.met(found.values[i], SURE * float(error[i]))
    return Verified(found.values, by_mesh, by_print, by_resin, met, robust, "", worst, words)


def _print_check(unit: Unit, printer: Printer, body: Body | None) -> tuple[str, tuple[str, ...]]:
    """The worst severity of the printability check, and its findings other than passes, as text."""
    try:
        solid = build_solid(unit, body=None if body is None else envelope(body, unit.dimensions))
    except MuError as error:
        return "error", (f"no solid: {error.what}",)
    stages, in_body = ("thickness", "chambers"), body is not None
    found = check(solid.vertices, solid.triangles, printer, unit, stages=stages, in_body=in_body)
    return found.worst, tuple(f"{f.severity}: {f.what}" for f in found.findings if f.severity != "pass")

"""Step change."""

from collections.abc import Iterable, Mapping, Sequence

from ...measured import Experiment
from .declaration import Declaration, Law, factor


def _later(tests: Sequence[Experiment]) -> Mapping[str, Iterable[str]]:
    """Tests from each on."""
    return {f"tests from {e.name} on": [later.name for later in tests[i:]] for i, e in enumerate(tests) if i}


EFFECT = Declaration(
    mechanism="between two tests something changed and stayed so: a clamp, a setting, damage",
    reveals="the first test again",
    remedy="find what was changed between these tests, and repeat the first one",
    modulus=True,
    differs=Law((), (factor("change", 0.1, "batches differ by 5 to 20 %, struts by more"),)),
    groups=_later,
)

"""Self-heating."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ...measured import Experiment
from .declaration import Declaration, Law, factor

# Rates of tests are two where they differ by more than this factor. Elastomers soften by some 0.5 % a kelvin,
# and double their modulus over some decades of rate at most.
FASTER = 1.5


def _faster(tests: Sequence[Experiment]) -> Mapping[str, Iterable[str]]:
    """Tests above each rate."""
    rates = sorted((rate, e.name) for e in tests if (rate := strain_rate(e)) > 0.0)
    return {
        f"tests at {100 * rate:.2g} %/s or faster": [name for _, name in rates[k:]]
        for k, (rate, _) in enumerate(rates[1:], 1)
        if rate > FASTER * rates[k - 1][0]
    }


def strain_rate(experiment: Experiment) -> float:
    """Median strain rate in 1/s of a specimen while it is strained; 0 without a clock."""
    if "time_s" not in experiment.columns or len(experiment) < 3:
        return 0.0
    rate = np.abs(np.gradient(experiment["strain"], experiment["time_s"]))
    moving = rate > 0.1 * rate.max()
    return float(np.median(rate[moving])) if moving.any() else 0.0


EFFECT = Declaration(
    mechanism="fast tests are scaled: the specimen warms itself and softens, or its rate stiffens it",
    reveals="the fast test after a pause, and with the rate of the slow one",
    remedy="test slowly or with pauses, or measure the specimen's temperature",
    modulus=True,
    differs=Law((), (factor("change", 0.1, "self-heating by some 10 K, stiffening by rate", (-0.3, 1.0)),)),
    groups=_faster,
)

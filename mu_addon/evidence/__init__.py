"""Evidence: causes of a model's misfit to measured data, their significance, and the gain of correcting them.

`diagnose` takes experiments and a `Simulator` of them and returns a `Verdict`: the effects that explain the
misfit, those that cannot be distinguished, the gain on data held out, and the experiment to make next. An
`Effect` is a mechanism with parameters that leave the model unchanged at their null.
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .diagnosis import diagnose
    from .effect import Effect, Parameter, bare, readable
    from .extended import ExtendedModel, extended_model, load_model
    from .fit import Fit, Fitter
    from .lattice_fem import scalings
    from .next_experiment import Proposal, propose_experiment
    from .noise import Source, Whitening
    from .prediction.bench import bench_simulators
    from .prediction.unit_pressure import UnitPressure
    from .record import Record
    from .sensitivity import Sensitivity
    from .simulator import Composite, Simulator, bends, unit_behind
    from .simulators import bending_freely, of_a_unit, simulations_plan
    from .unit_fem import unit_responses
    from .unit_settings import UnitSettings
    from .verdict import Verdict
else:
    __getattr__, __dir__, __all__ = public_face(__name__)

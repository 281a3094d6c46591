"""Evidence: causes of a model's misfit to measured data, their significance, and the gain of correcting them.

`diagnose` takes experiments and a `Simulator` of them and returns a `Verdict`: the effects that explain the
misfit, those that cannot be distinguished, the gain on data held out, and the experiment to make next. An
`Effect` is a mechanism with parameters that leave the model unchanged at their null.
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .diagnosis import diagnose as diagnose
    from .effect import Effect as Effect
    from .effect import Parameter as Parameter
    from .effect import bare as bare
    from .effect import readable as readable
    from .extended import ExtendedModel as ExtendedModel
    from .extended import extended_model as extended_model
    from .extended import load_model as load_model
    from .fit import Fit as Fit
    from .fit import Fitter as Fitter
    from .lattice_fem import scalings as scalings
    from .next_experiment import Proposal as Proposal
    from .next_experiment import propose_experiment as propose_experiment
    from .noise import Source as Source
    from .noise import Whitening as Whitening
    from .prediction.bench import bench_simulators as bench_simulators
    from .prediction.unit_pressure import UnitPressure as UnitPressure
    from .record import Record as Record
    from .sensitivity import Sensitivity as Sensitivity
    from .simulator import Composite as Composite
    from .simulator import Simulator as Simulator
    from .simulator import bends as bends
    from .simulator import unit_behind as unit_behind
    from .simulators import bending_freely as bending_freely
    from .simulators import of_a_unit as of_a_unit
    from .simulators import simulations_plan as simulations_plan
    from .unit_fem import UnitSettings as UnitSettings
    from .unit_fem import unit_responses as unit_responses
    from .verdict import Verdict as Verdict
else:
    __getattr__, __dir__, __all__ = public_face(__name__)

"""A unit's motion and the ranking of its sensor paths: the work of the stages of `studies.unit_ranking`."""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .compared_pressures import (
        Array,
        Followed,
        Member,
        PathCheck,
        RankingSetup,
        Solved,
        Standing,
        followed,
        following,
        solved,
        solving,
        waveguides_of,
    )
    from .graph_search import Predicted, Sensitivity, predicted, sensitivity_map
    from .mechanics import Mechanics, Samples
    from .model_a import InTime, solve_in_time
    from .motion import (
        MotionTables,
        StateFields,
        motion_in_time,
        motion_of,
        reached_of,
        state_after,
        state_fields,
        tables_of,
    )
    from .motion_checks import doubts_of_protocol
    from .motion_tables import Reached, angles_of
    from .named_effects import NamedEffects
    from .path_motion import PathMotion, PathMotions
    from .place_stages import (
        CheckedPath,
        Light,
        NamedMotion,
        SearchOutcome,
        Uncertainty,
        check_path,
        checked_paths,
        differences,
        estimates,
        letting_in,
        lit,
        marched,
        motion_of_best,
        require_paths,
        search_of,
        sweep_figures,
        uncertainty,
        whole_motion,
        words_on_estimates,
        words_on_solved,
    )
    from .ranking import Ranking, extremes, ranked
    from .settings import ESTIMATED, left_out
    from .shown_motion import (
        assumption_parts,
        built_parts,
        contact_parts,
        finished_motion_parts,
        motion_parts,
        parameter_table,
        unfinished_motion_parts,
    )
    from .shown_ranking import (
        answer_parts,
        contest_doubts,
        estimate_parts,
        heatmap_parts,
        light_parts,
        marginal_parts,
        path_motion_parts,
        ranking_parts,
        search_parts,
        sensitivity_parts,
        uncertainty_doubts,
    )
else:
    __getattr__, __dir__, __all__ = public_face(__name__)

"""A unit's motion and the ranking of its sensor paths: the work of the stages of `studies.unit_ranking`."""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .candidates import Array as Array
    from .candidates import Comparison as Comparison
    from .candidates import Followed as Followed
    from .candidates import Member as Member
    from .candidates import PathCheck as PathCheck
    from .candidates import Solved as Solved
    from .candidates import Standing as Standing
    from .candidates import followed as followed
    from .candidates import following as following
    from .candidates import solved as solved
    from .candidates import solving as solving
    from .candidates import waveguides_of as waveguides_of
    from .graph_search import Predicted as Predicted
    from .graph_search import Sensitivity as Sensitivity
    from .graph_search import predicted as predicted
    from .graph_search import sensitivity_map as sensitivity_map
    from .mechanics import Mechanics as Mechanics
    from .mechanics import Samples as Samples
    from .model_a import InTime as InTime
    from .model_a import solve_in_time as solve_in_time
    from .motion import MotionTables as MotionTables
    from .motion import StateFields as StateFields
    from .motion import mesh_of as mesh_of
    from .motion import motion_in_time as motion_in_time
    from .motion import motion_of as motion_of
    from .motion import reached_of as reached_of
    from .motion import state_after as state_after
    from .motion import state_fields as state_fields
    from .motion import tables_of as tables_of
    from .motion_checks import doubts_of_protocol as doubts_of_protocol
    from .motion_tables import Reached as Reached
    from .motion_tables import angles_of as angles_of
    from .named_effects import NamedEffects as NamedEffects
    from .path_motion import PathMotion as PathMotion
    from .path_motion import PathMotions as PathMotions
    from .place_stages import CheckedPath as CheckedPath
    from .place_stages import Light as Light
    from .place_stages import NamedMotion as NamedMotion
    from .place_stages import SearchOutcome as SearchOutcome
    from .place_stages import Uncertainty as Uncertainty
    from .place_stages import check_path as check_path
    from .place_stages import checked_paths as checked_paths
    from .place_stages import differences as differences
    from .place_stages import estimates as estimates
    from .place_stages import letting_in as letting_in
    from .place_stages import lit as lit
    from .place_stages import marched as marched
    from .place_stages import motion_of_best as motion_of_best
    from .place_stages import ranked as ranked
    from .place_stages import require_paths as require_paths
    from .place_stages import search_of as search_of
    from .place_stages import sweep_figures as sweep_figures
    from .place_stages import uncertainty as uncertainty
    from .place_stages import whole_motion as whole_motion
    from .place_stages import words_on_estimates as words_on_estimates
    from .place_stages import words_on_solved as words_on_solved
    from .ranking import Ranking as Ranking
    from .ranking import extremes as extremes
    from .settings import ESTIMATED as ESTIMATED
    from .settings import left_out as left_out
    from .shown_motion import assumption_parts as assumption_parts
    from .shown_motion import built_parts as built_parts
    from .shown_motion import contact_parts as contact_parts
    from .shown_motion import finished_motion_parts as finished_motion_parts
    from .shown_motion import motion_parts as motion_parts
    from .shown_motion import parameter_table as parameter_table
    from .shown_motion import unfinished_motion_parts as unfinished_motion_parts
    from .shown_ranking import answer_parts as answer_parts
    from .shown_ranking import contest_doubts as contest_doubts
    from .shown_ranking import estimate_parts as estimate_parts
    from .shown_ranking import heatmap_parts as heatmap_parts
    from .shown_ranking import light_parts as light_parts
    from .shown_ranking import marginal_parts as marginal_parts
    from .shown_ranking import path_motion_parts as path_motion_parts
    from .shown_ranking import ranking_parts as ranking_parts
    from .shown_ranking import search_parts as search_parts
    from .shown_ranking import sensitivity_parts as sensitivity_parts
    from .shown_ranking import uncertainty_doubts as uncertainty_doubts
else:
    __getattr__, __dir__, __all__ = public_face(__name__)

"""The stages of a study of one unit, in the order they need each other: design, simulate, place."""

from __future__ import annotations

from ...design.anchors import Window, window
from .graph_search import search_graph, sensitivity_map
from .light import signals
from .study import Study


def run_stages(study: Study, path: Window | None = None) -> None:
    """Every stage of a study's job; path: also the unit with a waveguide along it."""
    study.design()
    if path is not None:
        study.design(path)
    stages = study.job.stages
    if "simulate" in stages:
        study.make_mesh()
        study.simulate(candidates_beside="place" in stages)
    if "place" in stages:
        chosen = study.place()
        if study.job.in_time:
            where = "Beside obstacles" if study.job.obstacles else "With a wall that remembers"
            study.warn(
                f"{where} neither the map of what each element would disturb nor what light would "
                "tell is known: both take a unit with one state a pressure."
            )
        else:
            if study.job.effects.clogged:
                study.warn(
                    "What each element alone would disturb is not known for a unit with a clogged neck."
                )
            else:
                sensitivity_map(study)
            signals(study, study.job.optics)
        if study.job.paths == "graph":
            search_graph(study)
        study.design(window(study.job.unit, chosen[study.headline_rule]))

"""The stages of a study of one unit in their order: design, simulate, place."""

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
            where = (
                "With obstacles" if study.job.obstacles else "With a wall whose state depends on its history"
            )
            study.warn(
                f"{where} neither the sensitivity map nor the light signal is computed: both need a unit "
                "whose state depends on pressure only."
            )
        else:
            if study.job.effects.clogged:
                study.warn("The sensitivity map is not computed for a unit with a clogged neck.")
            else:
                sensitivity_map(study)
            signals(study, study.job.optics)
        if study.job.paths == "graph":
            search_graph(study)
        study.design(window(study.job.unit, chosen[study.headline_rule]))

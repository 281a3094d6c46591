"""A made-up ranking that looks like a real one: the paper's J_hat and plausible fields; and its report."""

from types import SimpleNamespace

import numpy as np
import trimesh

from mu_addon.design.parameters import load_preset
from mu_addon.placement.deviation import deviation_of
from mu_addon.report.results import Path, SideView
from mu_addon.report.study_report import page_of
from mu_addon.run.context import RunContext
from mu_addon.run.progress import Progress
from mu_addon.simulate_and_place.ranking import Ranking
from mu_addon.studies.unit_ranking import UnitStudy

STUDY = UnitStudy(unit=load_preset("mu-1.0x"), times=41, stations=60)
PATHS = tuple(Path(w.name, w.start, w.length) for w in STUDY.windows)
J_HAT = np.array([0.248, 0.376, 0.315, 0.155, 0.436, 0.493, 0.351, 0.550, 0.522, 0.575])
TIME, PRESSURE = STUDY.samples.time_s, STUDY.samples.pressure_kPa
ANGLE = np.where(PRESSURE < 0, 2.1 * PRESSURE, 1.9 * PRESSURE - 0.012 * PRESSURE**2)
VIEW = SideView(
    np.full((170, 110, 4), (150, 160, 175, 255), np.uint8),
    (-19.0, 32.0, -6.0, 75.0),
    STUDY.anchors[:, 1:],
)
SECONDS = {"solid": 1.5, "mesh": 6.2, "Model A": 31.0, "candidates": 64.3, "report": 4.0}
BOX = trimesh.creation.box((30.0, 30.0, 80.0), trimesh.transformations.translation_matrix((0, 0, 40)))
SOLID = SimpleNamespace(vertices=BOX.vertices, triangles=BOX.faces)


def delta(path, mean):
    """Deviation (k, j) in mm: grows with pressure and past the stiffened window, with J_hat as its mean."""
    noise = np.random.default_rng(path.start + 10 * path.length)
    station = np.linspace(0.0, 1.0, STUDY.stations)
    center = (path.start + 0.5 * path.length - 1) / 6.0
    along = 0.05 + 1.0 / (1.0 + np.exp(-(station - center) * 9.0)) * (0.4 + 0.6 * station)
    over = np.abs(ANGLE) ** 1.2 * np.where(PRESSURE < 0, 0.7, 1.0)
    field = over[:, None] * along * (1.0 + 0.03 * noise.standard_normal(len(station)).cumsum() / 8)
    return mean * field / field.mean()


def ranking(without=(), missed=slice(0), uncertainty_mm=0.03, **more):
    """The ranking of all paths but some; missed: instants that are not compared."""
    found = {}
    for path, mean in zip(PATHS, 0.31 * J_HAT, strict=True):
        if path.name not in without:
            values = delta(path, mean)
            values[missed] = np.nan
            found[path.name] = deviation_of(values)
    return Ranking(found, uncertainty_mm, **more)


def report(folder, one):
    """The report of a ranking as HTML text."""
    given = {
        "answer": (SOLID, one),
        "ranks": (None, one),
        "maps": (one,),
        "marginals": (one,),
        "assumed": (),
        "parameters": (),
    }
    sections = {one.method.__name__: one for one in STUDY.sections()}
    shown = []
    for name, values in given.items():
        parts = sections[name].method(STUDY, *values)
        # Pictures for panels take as long to draw as all others.
        shown.append((sections[name], [part for part in parts if getattr(part, "shown", True)]))
    return page(STUDY, shown, folder, {"seconds": SECONDS})


def page(study, shown, folder, summary, stopped="", hurried=False):
    """The report of sections with their parts as HTML text."""
    context = RunContext(Progress([]), summary=summary, hurried=hurried)
    work = SimpleNamespace(study=study, shown=shown, context=context, folder=folder)
    return page_of(work, {"numpy": "1.26.4"}, stopped)

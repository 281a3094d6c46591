"""What `design`, `simulate` and `place` share: a study of one unit, and the stages of it that are run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_solver, modelled, solver_of, unit_of

if TYPE_CHECKING:
    from ..design.body import Body
    from ..design.parameters import Unit
    from ..design.rigid_body import RigidBody
    from ..run.context import RunContext
    from ..run.progress import Progress
    from ..usecases.simulate_and_place.study import Study

EXAMPLE = "example: run.py place --preset mu-1.0x --out out/mu-1.0x"


def add_solid(command: argparse.ArgumentParser) -> None:
    """How fine the STL is."""
    command.add_argument(
        "--quality",
        choices=("interactive", "export"),
        default="interactive",
        help="Facet resolution of the STL (default: interactive).",
    )


def add_body(command: argparse.ArgumentParser) -> None:
    """A body of the user's own around the chambers."""
    command.add_argument(
        "--body",
        metavar="FILE",
        help="Closed surface that the lattice fills in place of its box: STL, OBJ or PLY, in mm, in the "
        "unit's frame. It is cut flat at both ends of the unit.",
    )


def add_obstacles(command: argparse.ArgumentParser) -> None:
    """Rigid bodies that the unit may touch, each with its friction."""
    command.add_argument(
        "--obstacle",
        action=_Obstacle,
        dest="obstacles",
        default=[],
        metavar="FILE",
        help="Closed surface of a rigid, fixed obstacle: STL, OBJ or PLY, in mm, in the unit's frame. "
        "Repeat the option for each obstacle.",
    )
    command.add_argument(
        "--friction",
        action=_Friction,
        type=float,
        metavar="MU",
        help="Coulomb friction coefficient of the preceding --obstacle (default: 0.5, assumed).",
    )


class _Obstacle(argparse.Action):
    """Adds a file of an obstacle, its friction still unsaid."""

    def __call__(self, parser: Any, namespace: Any, value: Any, option: Any = None) -> None:
        namespace.obstacles = [*namespace.obstacles, (value, None)]


class _Friction(argparse.Action):
    """Says the friction of the obstacle before it."""

    def __call__(self, parser: Any, namespace: Any, value: Any, option: Any = None) -> None:
        if not namespace.obstacles or namespace.obstacles[-1][1] is not None:
            parser.error("--friction: give it after the --obstacle that it belongs to")
        *before, (path, _) = namespace.obstacles
        namespace.obstacles = [*before, (path, value)]


def add_simulation(command: argparse.ArgumentParser) -> None:
    """Protocol, mesh and material of a simulation."""
    command.add_argument(
        "--protocol",
        metavar="CSV",
        help="Pressure protocol, CSV with the columns time_s,pressure_kPa (default: the shipped grasp "
        "protocol).",
    )
    command.add_argument(
        "--order", type=int, choices=(1, 2), default=2, help="Order of the finite elements (default: 2)."
    )
    command.add_argument(
        "--refine",
        type=float,
        default=1.0,
        metavar="F",
        help="Mesh refinement: every element size is divided by F (default: 1).",
    )
    command.add_argument(
        "--lattice",
        metavar="FILE",
        help="Lattice law computed from struts and resin, the effective.toml of `homogenize`; a copy is "
        "stored with the results (default: neo-Hookean with the unit's material.lattice_modulus_kPa "
        "and lattice_poisson).",
    )
    command.add_argument(
        "--times",
        type=int,
        default=13,
        metavar="K",
        help="Number of time samples of the protocol (default: 13).",
    )
    command.add_argument(
        "--mesher",
        choices=("auto", "gmsh", "pytetwild"),
        default="auto",
        help="Mesh generator (default: auto).",
    )
    add_solver(command)


def run(options: argparse.Namespace, progress: Progress, context: RunContext) -> None:
    """Run the stages that `options.stages` names, and publish what they found."""
    from ..usecases.simulate_and_place.report_data import write_report

    study = _open(options, progress, context)
    context.on_stop = lambda reason: write_report(study, reason["what"])
    _run(study, options)


def _open(options: argparse.Namespace, progress: Progress, context: RunContext) -> Study:
    from ..homogenize.effective import read_effective
    from ..meshing.settings import MeshSettings
    from ..placement.graph import Limits
    from ..usecases.simulate_and_place.extended_unit import require_same_print
    from ..usecases.simulate_and_place.job import Job, optics_of, protocol_of
    from ..usecases.simulate_and_place.study import Study

    extra: dict[str, Any] = {}
    if "simulate" not in options.stages:
        unit = unit_of(options)
    else:
        unit, effects = modelled(options, progress, context)
        extra = {
            "effects": effects,
            "mesh": MeshSettings(order=options.order, refine=options.refine),
            "times": options.times,
            "mesher": options.mesher,
            "solver": solver_of(options),
            "lattice": None if options.lattice is None else read_effective(options.lattice),
        }
    if "place" in options.stages:
        rules = ("intersect", "volume_fraction") if options.rule == "both" else (options.rule,)
        extra |= {
            "stations": options.stations,
            "rules": rules,
            "workers": options.workers,
            "mesh_check": options.mesh_check,
            "paths": options.paths,
            "limits": Limits(options.shortest_cells, options.longest_cells, options.bend_deg),
            "most_checks": options.checks,
            "optics": optics_of(options.light),
        }
    if extra.get("lattice") is not None and context.summary.get("model", {}).get("applied"):
        require_same_print(unit, extra["lattice"], options.model)
    protocol = protocol_of(getattr(options, "protocol", None))
    if getattr(options, "body", None) is not None:
        extra["body"] = _body(options, unit)
    if getattr(options, "obstacles", None):
        extra["obstacles"] = _obstacles(options, unit, extra.get("body"))
    job = Job(unit=unit, protocol=protocol, quality=options.quality, stages=options.stages, **extra)
    return Study.open(job, Path(options.out), progress, context)


def _body(options: argparse.Namespace, unit: Unit) -> Body:
    """The body of --body, cut to the unit's length; raises InputError, also where a path leaves it."""
    from ..design.anchors import windows
    from ..design.body import envelope, read_body, require_path_inside
    from ..errors import InputError

    body = envelope(read_body(options.body), unit.dimensions)
    if "place" in options.stages:
        if options.paths == "graph":
            raise InputError(
                "the search of the whole lattice supports only the default box of the lattice",
                "--body, --paths graph",
                "leave one of them out",
            )
        for window in windows(unit.chambers.count):
            require_path_inside(body, unit, window)
    return body


def _obstacles(options: argparse.Namespace, unit: Unit, own: Body | None) -> tuple[RigidBody, ...]:
    """The bodies of --obstacle; raises InputError, also where one stands in the unit at rest."""
    from ..design.body import read_body
    from ..design.rigid_body import FRICTION, RigidBody, require_beside

    found = [RigidBody(read_body(f), FRICTION if mu is None else mu) for f, mu in options.obstacles]
    require_beside(found, unit.dimensions, own)
    return tuple(found)


def _run(study: Study, options: argparse.Namespace) -> None:
    from ..design.anchors import window
    from ..usecases.simulate_and_place.report_data import write_report
    from ..usecases.simulate_and_place.run import run_stages

    # An unknown path is found out before an hour's work, not after.
    path = window(study.job.unit, options.path) if getattr(options, "path", None) is not None else None
    if study.job.paths == "graph":
        from ..usecases.simulate_and_place.graph_search import chains_within

        chains_within(study.job)
    run_stages(study, path)
    write_report(study)


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Angles, chosen paths and the best of a search, as far as the stages went."""
    lines = []
    angles = summary.get("angle_deg")
    if isinstance(angles, dict):
        ends = sorted((float(p), a) for p, a in angles.items())
        lines.append("angle: " + ", ".join(f"{a:+.1f} deg at {p:g} kPa" for p, a in (ends[0], ends[-1])))
    chosen = summary.get("chosen")
    if isinstance(chosen, dict):
        J, tied = summary["J_hat_mm"], summary["tied_with_chosen"]
        for rule, name in chosen.items():
            equal = f", tied with {', '.join(tied[rule])}" if tied[rule] else ""
            lines.append(f"{rule}: {name}, J_hat {J[rule][name]:.4f} mm{equal}")
    search = summary.get("search")
    if isinstance(search, dict):
        best = search["best"]
        lines.append(
            f"whole-lattice search, {search['rule']}: {best['name']}, J_hat {best['J_hat_mm']:.4f} mm, "
            f"{best['length_mm']:.1f} mm long; {search['checked']} of {search['paths']} paths solved by the "
            "full model"
        )
    return lines

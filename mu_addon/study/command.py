"""The command line: what each subcommand takes, and how it ends."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from .ending import Ending
    from .progress import Progress
    from .study import Study

EXAMPLE = "example: run.py place --preset mu-1.0x --out out/mu-1.0x"
STATUSES = (
    "exit status: 0 done, 2 wrong input, 3 no mesh, 4 no equilibrium, 5 cannot write, 6 not printable, "
    "70 fault of this program, 130 Ctrl-C, 143 terminated"
)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, and where help is."""

    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(2, f"error: {message}\n  what to do: {self.prog} --help lists what there is\n")


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    top = _Parser(
        "run.py", description="Monolithic Units: design, simulate, place the sensor.", epilog=STATUSES
    )
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=_Parser)

    presets = commands.add_parser("presets", help="list the presets that come with the package")
    presets.set_defaults(stages=())

    design = commands.add_parser("design", help="printable solid, STL and lattice nodes", epilog=EXAMPLE)
    _add_unit(design)
    _add_solid(design)
    design.add_argument(
        "--path", metavar="NAME", help="also the unit with a waveguide along this path, alpha1 .."
    )
    design.set_defaults(stages=("design",))

    simulate = commands.add_parser(
        "simulate", help="... and its motion under a pressure protocol", epilog=EXAMPLE
    )
    _add_unit(simulate)
    _add_model(simulate)
    _add_solid(simulate)
    _add_simulation(simulate)
    simulate.set_defaults(stages=("design", "simulate"))

    place = commands.add_parser(
        "place", help="... and the ranking of sensor paths (the main job)", epilog=EXAMPLE
    )
    _add_unit(place)
    _add_model(place)
    _add_solid(place)
    _add_simulation(place)
    place.add_argument(
        "--stations", type=int, default=51, metavar="J", help="stations along the backbone (51)"
    )
    place.add_argument(
        "--rule",
        choices=("both", "intersect", "volume_fraction"),
        default="both",
        help="how an inclusion stiffens the elements it touches (both)",
    )
    place.add_argument("--workers", type=int, default=2, metavar="N", help="processes for the candidates (2)")
    place.add_argument(
        "--no-mesh-check",
        dest="mesh_check",
        action="store_false",
        help="leave out the second mesh that tells how far the mesh moves the ranking",
    )
    place.add_argument(
        "--paths",
        choices=("windows", "graph"),
        default="windows",
        help="graph: search the whole lattice for the best path, bent ones too (windows)",
    )
    search = place.add_argument_group("limits of --paths graph")
    search.add_argument(
        "--shortest-cells", type=float, default=2.0, metavar="C", help="shortest path, in cells (2)"
    )
    search.add_argument(
        "--longest-cells", type=float, default=float("inf"), metavar="C", help="longest path, in cells (any)"
    )
    search.add_argument("--bend-deg", type=float, default=75.0, metavar="A", help="sharpest bend (75)")
    search.add_argument(
        "--checks", type=int, default=100, metavar="N", help="paths solved exactly at most (100)"
    )
    place.set_defaults(stages=("design", "simulate", "place"))

    _add_homogenize(commands)
    _add_fit_material(commands)
    _add_diagnose(commands)
    _add_design_experiments(commands)
    return top


def _add_homogenize(commands: argparse._SubParsersAction[_Parser]) -> None:
    command = commands.add_parser(
        "homogenize",
        help="the lattice's moduli from its struts and resin, virtual compression tests, its law for `place`",
        epilog="example: run.py homogenize --preset mu-1.0x --out out/lattice",
    )
    _add_unit(command)
    _add_model(command)
    command.add_argument(
        "--resin",
        metavar="NAME|FILE",
        help="a material of the library, or its TOML file (the modulus of the unit's membrane)",
    )
    command.add_argument(
        "--cells", type=int, default=3, metavar="N", help="cells along each side of the specimen (3)"
    )
    command.add_argument(
        "--friction",
        choices=("both", "slide", "stick"),
        default="both",
        help="whether plates let the specimen's faces slide or hold them (both)",
    )
    command.add_argument(
        "--strain", type=float, default=0.4, metavar="E", help="nominal compression to go to (0.4)"
    )
    command.add_argument(
        "--no-specimen", dest="specimen", action="store_false", help="only the endless lattice"
    )
    command.add_argument(
        "--refine", type=float, default=1.0, metavar="F", help="divides the size of the cell's elements (1)"
    )
    command.set_defaults(stages=())


def _add_fit_material(commands: argparse._SubParsersAction[_Parser]) -> None:
    command = commands.add_parser(
        "fit-material",
        help="laws fitted to coupon tests, and the best as a material for simulations",
        epilog="example: run.py fit-material my-coupons --out out/resin",
    )
    command.add_argument("folder", metavar="FOLDER", help="measured data: experiments.toml and its CSV files")
    _add_results(command)
    command.add_argument(
        "--laws",
        nargs="+",
        default=(),
        metavar="LAW",
        help="neo-hooke, mooney-rivlin, yeoh, ogden-1, ogden-2, ogden-3 (all)",
    )
    command.add_argument(
        "--hold-out",
        nargs="+",
        default=(),
        metavar="MODE",
        help="modes to check and not to fit: uniaxial, equibiaxial, pure_shear (none)",
    )
    command.add_argument(
        "--weights",
        choices=("absolute", "relative"),
        default="absolute",
        help="residuals as a share of their test's largest stress, or of the stress itself (absolute)",
    )
    command.set_defaults(stages=())


def _add_diagnose(commands: argparse._SubParsersAction[_Parser]) -> None:
    command = commands.add_parser(
        "diagnose",
        help="what measured data say is wrong with the model, why, and what mending it gains",
        epilog="example: run.py diagnose assets/examples/paper-moduli --out out/why",
    )
    command.add_argument("folder", metavar="FOLDER", help="measured data: experiments.toml and its CSV files")
    _add_unit(command, required=False)
    command.set_defaults(stages=())


def _add_design_experiments(commands: argparse._SubParsersAction[_Parser]) -> None:
    command = commands.add_parser(
        "design-experiments",
        help="before measuring: which effects planned experiments would show, from which size on",
        epilog="example: run.py design-experiments my-protocols --noise angle=0.5 --out out/plan",
    )
    command.add_argument(
        "folder", metavar="FOLDER", help="as for `diagnose`; what would be measured may hold any numbers"
    )
    _add_unit(command, required=False)
    command.add_argument(
        "--noise",
        nargs="+",
        default=(),
        metavar="QUANTITY=VALUE",
        help="standard deviation of a reading, in the unit of its column (angle=0.3 marker=0.1 stress=0.1 "
        "pressure=0.1 tip_deflection=0.1 voltage=0.002)",
    )
    command.set_defaults(stages=())


def _add_results(command: argparse.ArgumentParser) -> None:
    command.add_argument("--out", required=True, metavar="DIR", help="folder for the results")
    command.add_argument("--json", action="store_true", help="one JSON message a line on standard output")


def _add_unit(command: argparse.ArgumentParser, required: bool = True) -> None:
    which = command.add_mutually_exclusive_group(required=required)
    which.add_argument("--preset", metavar="NAME", help="a preset: mu-0.75x, mu-1.0x, mu-1.5x")
    which.add_argument("--unit", metavar="FILE", help="a unit's parameters, TOML")
    _add_results(command)


def _add_model(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--model", metavar="FILE", help="model.toml of `diagnose`: what it found is put into the unit"
    )


def _add_solid(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--quality",
        choices=("interactive", "export"),
        default="interactive",
        help="facets of the STL (interactive)",
    )


def _add_simulation(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--protocol", metavar="CSV", help="time_s,pressure_kPa (the grasp that comes with it)"
    )
    command.add_argument("--order", type=int, choices=(1, 2), default=2, help="order of the elements (2)")
    command.add_argument(
        "--refine", type=float, default=1.0, metavar="F", help="divides every element size (1)"
    )
    command.add_argument(
        "--lattice",
        metavar="FILE",
        help="effective.toml of `homogenize`: the lattice's law, from its struts and resin, kept in the "
        "results (without it the unit's material.lattice_modulus_kPa and lattice_poisson, neo-Hookean)",
    )
    command.add_argument("--times", type=int, default=13, metavar="K", help="samples of the protocol (13)")
    command.add_argument(
        "--mesher", choices=("auto", "gmsh", "pytetwild"), default="auto", help="who makes the mesh (auto)"
    )


def main(arguments: list[str]) -> int:
    """Run one command line; returns its exit status and never raises."""
    options = parser().parse_args(arguments)
    if options.command == "presets":
        return _presets()

    # Only now, so that --help answers at once.
    from .ending import run_to_end
    from .progress import Progress, json_lines, terminal

    progress = Progress([json_lines(sys.stdout) if options.json else terminal(sys.stderr)])
    answer = _answer
    with run_to_end(progress) as ending:
        if options.command == "homogenize":
            from .homogenizing import answer

            _homogenize(options, progress, ending)
        elif options.command == "fit-material":
            from .fitting import answer

            _fit_material(options, progress, ending)
        elif options.command == "diagnose":
            from .diagnosing import answer

            _diagnose(options, progress, ending)
        elif options.command == "design-experiments":
            from .protocol_design import answer

            _design_experiments(options, progress, ending)
        else:
            _study(options, progress, ending)
    if ending.status == 0 and not options.json:
        sys.stdout.write("\n".join([f"results: {ending.folder}", *answer(ending.summary)]) + "\n")
    return ending.status


def _study(options: argparse.Namespace, progress: Progress, ending: Ending) -> None:
    from .publish import publish

    study = _open(options, progress, ending)
    ending.on_stop = lambda reason: publish(study, reason["what"])
    _run(study, options)


def _homogenize(options: argparse.Namespace, progress: Progress, ending: Ending) -> None:
    from .homogenizing import FRICTIONS, Job, homogenize, resin_of

    unit = _modelled(options, progress, ending)
    frictions = FRICTIONS if options.friction == "both" else (options.friction,)
    job = Job(
        unit=unit,
        resin=resin_of(options.resin, unit),
        cells=options.cells,
        frictions=frictions if options.specimen else (),
        strain=options.strain,
        refine=options.refine,
    )
    homogenize(job, Path(options.out), progress, ending)


def _fit_material(options: argparse.Namespace, progress: Progress, ending: Ending) -> None:
    from .fitting import fit_material

    _require_folder(options)
    fit_material(
        Path(options.folder),
        Path(options.out),
        options.laws,
        options.hold_out,
        options.weights,
        progress=progress,
        ending=ending,
    )


def _diagnose(options: argparse.Namespace, progress: Progress, ending: Ending) -> None:
    from .diagnosing import diagnose_folder

    _require_folder(options)
    unit = None if options.preset is None and options.unit is None else _unit(options)
    diagnose_folder(Path(options.folder), Path(options.out), unit, progress=progress, ending=ending)


def _design_experiments(options: argparse.Namespace, progress: Progress, ending: Ending) -> None:
    from .protocol_design import design_experiments, noise_of

    _require_folder(options)
    unit = None if options.preset is None and options.unit is None else _unit(options)
    noise = noise_of(options.noise)
    design_experiments(Path(options.folder), Path(options.out), unit, noise, progress=progress, ending=ending)


def _presets() -> int:
    from ..design.parameters import load_preset, preset_names

    for name in preset_names():
        d = load_preset(name).dimensions
        sys.stdout.write(f"{name:12s} cell {d.cell:g} mm, {d.count} chambers, {d.height:g} mm long\n")
    return 0


def _unit(options: argparse.Namespace) -> Unit:
    from ..design.parameters import load_preset, read_unit

    _require_folder(options)
    return load_preset(options.preset) if options.preset is not None else read_unit(options.unit)


def _modelled(options: argparse.Namespace, progress: Progress, ending: Ending) -> Unit:
    """The unit, with what an extended model adds to it."""
    unit = _unit(options)
    if getattr(options, "model", None) is None:
        return unit
    from .model_file import read_extended

    found = read_extended(unit, options.model)
    for words in found.left_out:
        progress.warning(f"not applied here: {words}", str(options.model))
    ending.summary["model"] = {"applied": found.applied, "left_out": found.left_out}
    return found.unit


def _require_folder(options: argparse.Namespace) -> None:
    from ..errors import InputError

    if not options.out.strip():
        raise InputError("no folder was named", "--out", "give a folder for the results")


def _open(options: argparse.Namespace, progress: Progress, ending: Ending) -> Study:
    from ..homogenize.effective import read_effective
    from ..meshing.settings import MeshSettings
    from ..placement.graph import Limits
    from .job import Job, protocol_of
    from .study import Study

    unit = _modelled(options, progress, ending)
    extra = {}
    if "simulate" in options.stages:
        extra = {
            "mesh": MeshSettings(order=options.order, refine=options.refine),
            "times": options.times,
            "mesher": options.mesher,
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
        }
    protocol = protocol_of(getattr(options, "protocol", None))
    job = Job(unit=unit, protocol=protocol, quality=options.quality, **extra)
    return Study.open(job, Path(options.out), progress, ending)


def _run(study: Study, options: argparse.Namespace) -> None:
    from ..design.anchors import window
    from .publish import publish

    # An unknown path is found out before an hour's work, not after.
    path = window(study.job.unit, options.path) if getattr(options, "path", None) is not None else None
    if study.job.paths == "graph":
        from .graph_search import chains_within

        chains_within(study.job)
    study.design()
    if path is not None:
        study.design(path)
    if "simulate" in options.stages:
        study.make_mesh()
        study.simulate(candidates_beside="place" in options.stages)
    if "place" in options.stages:
        from .graph_search import search_graph, sensitivity_map

        chosen = study.place()
        sensitivity_map(study)
        if study.job.paths == "graph":
            search_graph(study)
        study.design(window(study.job.unit, chosen[study.headline_rule]))
    publish(study)


def _answer(summary: dict[str, Any]) -> list[str]:
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
            f"whole lattice, {search['rule']}: {best['name']}, J_hat {best['J_hat_mm']:.4f} mm, "
            f"{best['length_mm']:.1f} mm long; {search['checked']} of {search['paths']} paths were solved"
        )
    return lines

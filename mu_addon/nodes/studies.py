"""The node of a study: sockets, settings and run, from its declaration."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import attrs

from ..design.gates import GateError
from ..errors import InputError
from ..graph.definition import FILE, Call, Definition, Input, Output, Outputs, Setting, setting
from ..graph.evaluation import Finished, Order
from ..meshing.settings import REFINE, SELF_CONTACT
from ..run.study import Input as Asked
from ..run.study import Node, Study
from ..simulate_and_place import settings as motion
from ..studies import study
from ..studies.parameter_study import settings as sweep
from .parts import refuse_body

REMARK = "remark"
MUTED = "this node and those that need it are not computed"
UNIT = Input("unit", ("unit",), "link a unit")
MODEL = Input("model", ("model",), "an extended model, by a node Diagnose", needed=False)


@attrs.frozen
class Linked:
    """How a node asks for an input of a kind that is no plain value.

    sockets, settings: of the node; value: the input by a call, its declaration and the inputs before it,
    which it may change. Raises InputError.
    """

    sockets: tuple[Input, ...] = ()
    settings: tuple[Setting, ...] = ()
    value: Callable[[Call, Any, dict[str, Any]], Any] = lambda call, one, values: None


def _linked(socket: Input, value_of: Callable[[Any], Any] = lambda linked: linked) -> Linked:
    """An input that is what is linked to one socket, None without."""

    def value(call: Call, one: Any, values: dict[str, Any]) -> Any:
        linked = call.inputs[socket.name]
        return None if linked is None else value_of(linked)

    return Linked((socket,), value=value)


def _effects(call: Call, one: Any, values: dict[str, Any]) -> Any:
    from ..simulate_and_place.extended_unit import read_extended
    from ..simulate_and_place.named_effects import NamedEffects

    effects, turn = NamedEffects(where=call.node), call.settings[motion.ORIENTATION.name]
    if call.inputs["model"] is not None:
        found = read_extended(values["unit"], call.inputs["model"])
        # The model changes the unit's parameters, too.
        values["unit"], effects = found.unit, found.effects
    return attrs.evolve(effects, orientation_deg=turn)


def _obstacles(call: Call, one: Any, values: dict[str, Any]) -> Any:
    from ..design.rigid_body import require_beside

    found = tuple(body for _, body in call.inputs["obstacles"])
    require_beside(found, values["unit"].dimensions, values["body"])
    return found


def _chain(call: Call, one: Any, values: dict[str, Any]) -> Any:
    from ..studies.chain import ChainUnit

    s = call.settings
    designs = [design for _, design in call.inputs["units"]] * s["copies"]
    for design in designs:
        refuse_body(design, "a chain")
    try:
        turns = [float(word) for word in s["turns_deg"].split()] or [0.0] * len(designs)
    except ValueError:
        what = f"{s['turns_deg']!r} are not numbers"
        raise InputError(what, "turns_deg", "give numbers, such as 0 0 180") from None
    if len(turns) != len(designs):
        what = f"{len(turns)} turns for {len(designs)} units"
        raise InputError(what, "turns_deg", "give one for each unit, or leave it empty")
    bounds = (s["low_kPa"], s["high_kPa"]) if s["reach"] else None
    return tuple(ChainUnit(d.unit, turn, bounds) for d, turn in zip(designs, turns, strict=True))


def _pressures(call: Call, one: Any, values: dict[str, Any]) -> Any:
    from ..chain.pressures import read_pressures

    file = call.settings["protocol"]
    return read_pressures(Path(file), len(values["units"])) if file else None


def _targets(call: Call, one: Any, values: dict[str, Any]) -> Any:
    from ..optimization import read_design

    design, file = call.inputs["unit"], call.settings["file"]
    if not file:
        raise InputError("no targets are named", "file", "give a design.toml")
    return read_design(Path(file), design.unit, design.body)


def _plan(call: Call, one: Any, values: dict[str, Any]) -> Any:
    """The plan of a node Parameter Study. Raises InputError."""
    from ..studies.parameter_study.plan import planned
    from ..toml_reader import TomlTable

    s, design = call.settings, call.inputs["unit"]
    refuse_body(design, "a parameter study")
    ranges = [given for _, given in call.inputs["ranges"]]
    names = [name for name, _ in ranges]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(
            f"{twice[0]} is varied by two ranges",
            "ranges",
            "leave one of them out, or vary another parameter",
        )
    simulate = {
        "times": s["times"],
        "mesh": {"refine": s["refine"]},
        **({"self_contact": True} if s["self_contact"] else {}),
        **({"self_friction": s["self_friction"]} if s["self_friction"] else {}),
    }
    plain = ("stages", "method", "points", "seed", "memory_MB", "minutes", "protocol")
    keys = {
        **{name: s[name] for name in plain},
        **{name: s[name].split() for name in ("minimize", "maximize")},
        **({"simulate": simulate} if s["stages"] != motion.STAGES[0] else {}),
        "vary": dict(ranges),
    }
    # It names no file: its folder decides nothing, and is the same everywhere.
    return planned(TomlTable(keys, call.node), design.unit, Path("/"))


def _model(linked: Any) -> Any:
    from ..evidence import load_model

    return load_model(linked)


LINKED = {
    "unit": _linked(UNIT, lambda linked: linked.unit),
    "body": Linked(value=lambda call, one, values: call.inputs["unit"].body),
    "window": Linked(value=lambda call, one, values: one.made((call.inputs["unit"].path,), values)),
    "bending": _linked(
        Input("bending", ("recording", "data"), "link recordings, or measured data", many=True),
        lambda linked: tuple(getattr(value, "folder", value) for _, value in linked),
    ),
    "gripper": _linked(Input("gripper", ("gripper",), "link a gripper")),
    "recording": _linked(Input("recording", ("recording",), "link a node Record or Recording"), Path),
    "measured": _linked(Input("data", ("data",), "link a node Measured Data")),
    "calibration": _linked(
        Input("calibration", ("calibration",), "link a node Calibrate or Calibration"), Path
    ),
    "model": _linked(MODEL, _model),
    "effects": Linked((MODEL,), (Setting(motion.ORIENTATION),), _effects),
    "obstacles": Linked(
        (Input("obstacles", ("obstacle",), "link nodes Obstacle", needed=False, many=True),),
        value=_obstacles,
    ),
    "design": Linked(
        (Input("unit", ("unit",), "link the unit where the search starts"),),
        (
            setting(
                "file",
                "",
                "design.toml of targets and freedoms; the linked unit and body replace those in it",
                path=FILE,
            ),
        ),
        _targets,
    ),
    "units": Linked(
        (Input("units", ("unit",), "link units, the one at the base first", many=True),),
        (
            setting("copies", 1, "number of times that the linked units are repeated", low=1, high=8),
            setting("turns_deg", "", "turn of each unit about the axis, such as 0 0 180; empty: none"),
            setting(
                "low_kPa", 0.0, "lowest pressure allowed to reach a point", unit="kPa", low=-99.0, high=1000.0
            ),
            setting("high_kPa", 30.0, "highest pressure", unit="kPa", low=-99.0, high=1000.0),
        ),
        _chain,
    ),
    "pressures": Linked(
        (),
        (
            setting(
                "protocol", "", "CSV of time_s, pressure_1_kPa and so on, a column for each unit", path=FILE
            ),
        ),
        _pressures,
    ),
    "plan": Linked(
        (UNIT, Input("ranges", ("range",), "link one or more nodes Range", many=True)),
        (
            Setting(sweep.LAST_STAGE),
            # A range has steps.
            Setting(sweep.METHOD._replace(default=sweep.GRID)),
            Setting(sweep.POINTS),
            Setting(sweep.SEED),
            Setting(motion.PROTOCOL, FILE),
            # Many studies are coarse ones.
            Setting(motion.TIMES._replace(default=7)),
            Setting(REFINE._replace(default=0.5)),
            Setting(SELF_CONTACT),
            Setting(motion.SELF_FRICTION),
            setting("minimize", "", "columns of the table to minimise, for Pareto fronts"),
            setting("maximize", "", "columns of the table to maximise"),
            *map(Setting, (sweep.MEMORY, sweep.MINUTES)),
        ),
        _plan,
    ),
}
"""By kind of an input that is no plain value."""


def node_of(name: str) -> Definition:
    """Definition of the node that runs a study's command."""
    kind = study(name)
    node = kind.node_of(name)
    assert node is not None
    asked = dict(_asked(kind, node))

    def read(call: Call, done: Finished) -> Outputs:
        if node.answers and done.summary.get("verdict") == "error":
            faults = done.summary.get("faults") or ["see its report"]
            raise GateError(f"not printable: {faults[0]}", str(done.folder), "see report.html in that folder")
        outputs = node.read(done, call) if node.read else {output: done for output, *_ in node.outputs}
        return {REMARK: node.remark(done.summary), **outputs}

    def passed(call: Call) -> Outputs:
        linked = call.inputs[node.passes[0]]
        remark = node.remark(linked.summary) if isinstance(linked, Finished) else ""
        return {node.outputs[0][0]: linked, REMARK: remark}

    sockets = [socket for one in asked.values() for socket in _sockets(one)]
    if node.continues:
        sockets = [Input(node.continues, (node.outputs[0][1],), f"link a {node.continues}")]
    return Definition(
        name,
        node.label or kind.__name__,
        node.category,
        node.text,
        tuple(dict.fromkeys(sockets)),
        tuple(Output(*one) for one in node.outputs),
        (*(s for one in asked.values() for s in _settings(one)), *node.settings),
        order=lambda call: _order(kind, node, name, call),
        read=read,
        muting=node.passes[1] or MUTED,
        mute=passed if node.passes[0] else None,
        remark=lambda outputs: str(outputs[REMARK]),
    )


def _asked(kind: type[Study], node: Node) -> Iterator[tuple[str, Asked]]:
    """Inputs that a node asks for."""
    for name, one in kind.inputs().items():
        if name not in node.hidden and (not node.shown or name in node.shown):
            yield name, one


def _sockets(one: Asked) -> tuple[Input, ...]:
    """Sockets of an input, also of one that a study may do without."""
    needed = getattr(one, "needed", True)
    found = LINKED[one.kind].sockets if one.kind in LINKED else ()
    return tuple(attrs.evolve(socket, needed=socket.needed and needed) for socket in found)


def _settings(one: Asked) -> tuple[Setting, ...]:
    if one.kind in LINKED:
        return LINKED[one.kind].settings
    return tuple(Setting(d, one.path) for d in (*one.descriptions, *getattr(one, "settings", ())))


def _order(kind: type[Study], node: Node, name: str, call: Call) -> Order:
    if node.no_body:
        refuse_body(call.inputs["unit"], node.no_body)
    values: dict[str, Any] = {}
    for field, one in _asked(kind, node):
        if one.kind in LINKED:
            values[field] = LINKED[one.kind].value(call, one, values)
        elif settings := _settings(one):
            values[field] = one.made(tuple(call.settings[s.name] for s in settings), values)
    if kind.commands:
        values["stages"] = tuple([*kind.commands][: [*kind.commands].index(name) + 1])
    if not node.continues:
        return Order(kind(**values).complete())
    done = call.inputs[node.continues]
    return Order(attrs.evolve(done.study, **values), done.folder)

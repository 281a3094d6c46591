"""Definition of a kind of node: inputs, outputs, their types, settings, and the computation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import attrs

from ..design.quantity import Description, described

NUMBER = "number"
"""Type of the outputs that may supply a setting's value."""
FILE, FOLDER = "file", "folder"


@attrs.frozen
class Setting:
    """A value set on a node itself; a number may come from another node instead.

    path: `FILE` or `FOLDER` if the value names one; shown: False if no editor shows it.
    """

    description: Description
    path: str = ""
    shown: bool = True

    @property
    def name(self) -> str:
        """Name of the setting, its unit at the end."""
        return self.description.name

    @property
    def is_number(self) -> bool:
        """True if its value is a number, which a link may supply."""
        return self.description.type in (int, float)

    def checked(self, value: Any) -> Any:
        """The value as its type; see `Description.checked`."""
        return self.description.checked(value)


def setting(
    name: str, default: Any, text: str, *, path: str = "", shown: bool = True, **more: Any
) -> Setting:
    """A setting that is no parameter of a unit; see `Setting`; more: unit, bounds, choices of `described`."""
    return Setting(described(name, default, text, **more), path, shown)


@attrs.frozen
class Input:
    """An input of a node: outputs of these types; where `only` is given, of these names alone.

    needed: the node cannot be evaluated without it; many: it accepts several links.
    """

    name: str
    types: tuple[str, ...]
    text: str
    only: tuple[str, ...] = ()
    needed: bool = True
    many: bool = False

    def refusal(self, output: Output) -> str:
        """Reason why an output cannot be linked here; "" if it can."""
        if output.type not in self.types:
            return f"{self.name} takes a {' or '.join(self.types)}, not a {output.type}"
        if self.only and output.name not in self.only:
            return f"{self.name} takes {' or '.join(self.only)}, not {output.name}"
        return ""


@attrs.frozen
class Output:
    """An output of a node: its name and type."""

    name: str
    type: str
    text: str = ""


@attrs.frozen
class Call:
    """One evaluation of a node: its name, checked settings, values of its inputs, and True if it is muted.

    inputs: by name; None without a link, a tuple of (name of the node, value) where it takes many.
    """

    node: str
    settings: Mapping[str, Any]
    inputs: Mapping[str, Any]
    muted: bool = False


Outputs = Mapping[str, Any]


@attrs.frozen(eq=False)
class Definition:
    """One kind of node.

    make: outputs by name, for a node that takes milliseconds. order: a run (`evaluation.Order`) for a slower
    node; read: its outputs, from the call and the finished run. muting: describes the effect of muting, "" if
    the node cannot be muted; mute: outputs of the muted node, without which no node after it is evaluated.
    remark: a short description of its outputs. named: outputs contain the node's name, for errors.
    """

    kind: str
    label: str
    category: str
    text: str
    inputs: tuple[Input, ...] = ()
    outputs: tuple[Output, ...] = ()
    settings: tuple[Setting, ...] = ()
    make: Callable[[Call], Outputs] | None = None
    order: Callable[[Call], Any] | None = None
    read: Callable[..., Outputs] | None = None
    muting: str = ""
    mute: Callable[[Call], Outputs] | None = None
    remark: Callable[[Outputs], str] = lambda outputs: ""
    named: bool = False

    @property
    def runs(self) -> bool:
        """True if its work is a separate run, in a folder."""
        return self.order is not None

    def setting(self, name: str) -> Setting | None:
        """The setting of that name, or None."""
        return next((s for s in self.settings if s.name == name), None)

    def input(self, name: str) -> Input | None:
        """The input, or the setting that is a number, of that name; None without one."""
        found = next((i for i in self.inputs if i.name == name), None)
        own = self.setting(name)
        if found is None and own is not None and own.is_number:
            return Input(name, (NUMBER,), own.description.text, needed=False)
        return found

    def output(self, name: str) -> Output | None:
        """The output of that name, or None."""
        return next((o for o in self.outputs if o.name == name), None)


def node(
    category: str,
    inputs: tuple[Input, ...] = (),
    outputs: tuple[Output, ...] = (),
    settings: tuple[Setting, ...] = (),
    *,
    label: str = "",
    **more: Any,
) -> Callable[[Callable[[Call], Outputs]], Definition]:
    """The kind of node whose outputs a function makes: it has the function's name, and its docstring as text.

    label: if not that name; more: of the `Definition`.
    """

    def of(make: Callable[[Call], Outputs]) -> Definition:
        kind, text = make.__name__.rstrip("_"), str(make.__doc__)
        named = label or kind.replace("_", " ").title()
        text = text[0].lower() + text[1:].rstrip(".")
        return Definition(kind, named, category, text, inputs, outputs, settings, make=make, **more)

    return of


Definitions = Mapping[str, Definition]

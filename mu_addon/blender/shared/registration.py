"""What a module hangs into Blender: declared where it stands, removed with the extension.

Blender's classes in a module are registered by themselves, and those of its `CLASSES`, which code makes; a
class without a `bl_idname` is called as it is, an operator MU_OT_add "mu.add". Decorators say the rest:
`property_of`, `handler`, `connected`, `menu`, `button`, `overlay`, `timer`, `at_start`, `at_end`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import bpy
from bpy.app.handlers import persistent
from bpy.props import PointerProperty

from .updates import Signal

RESTORED = ("undo_post", "redo_post", "load_post")
"""Events after which the scene is another one."""
_PROPERTIES, _CLASSES, _CALLS = range(3)


class Hook(NamedTuple):
    """Something in Blender, and how it is taken out; those of a lower rank are put in first."""

    rank: int
    add: Callable[[], Any]
    remove: Callable[[], Any]


_declared: dict[str, dict[str, Hook]] = {}
"""By module and name: its declarations."""
_made: dict[str, list[Any]] = {}
"""By module: classes that are made of its functions."""
_there: list[Hook] = []


def register(modules: Iterable[Any]) -> None:
    """Put everything that modules declare into Blender, once; on failure nothing is left behind."""
    if _there:
        return
    try:
        for hook in sorted((h for module in modules for h in _hooks(module)), key=lambda hook: hook.rank):
            hook.add()
            _there.append(hook)
    except Exception:
        unregister()
        raise


def unregister() -> None:
    """Take all of it out, the last first."""
    while _there:
        _there.pop().remove()


def classes_of(module: Any) -> Iterator[Any]:
    """Blender's classes of a module: those that code makes, then those that stand in it, in order."""
    by_code = (*getattr(module, "CLASSES", ()), *_made.get(module.__name__, ()))
    stand = (v for v in vars(module).values() if isinstance(v, type) and v.__module__ == module.__name__)
    for cls in (*by_code, *stand):
        # Blender has tools registered in a way of their own.
        if issubclass(cls, bpy.types.bpy_struct) and not issubclass(cls, bpy.types.WorkSpaceTool):
            yield cls


def _hooks(module: Any) -> Iterator[Hook]:
    yield from map(_class, classes_of(module))
    yield from _declared.get(module.__name__, {}).values()


def _idname(operator: Any) -> str:
    return f"mu.{operator.__name__.removeprefix('MU_OT_')}"


def _class(cls: Any) -> Hook:
    if "bl_idname" not in vars(cls):
        cls.bl_idname = _idname(cls) if issubclass(cls, bpy.types.Operator) else cls.__name__
    rank = _PROPERTIES if issubclass(cls, bpy.types.PropertyGroup) else _CLASSES
    return Hook(rank, lambda: bpy.utils.register_class(cls), lambda: bpy.utils.unregister_class(cls))


def made(cls: Any) -> None:
    """Have a class registered with its module, in which it does not stand by its name."""
    _made.setdefault(cls.__module__, []).append(cls)


def _nothing() -> None:
    pass


def _declare(
    of: Any, add: Callable[[], Any] = _nothing, remove: Callable[[], Any] = _nothing, what: str = ""
) -> Any:
    """Have something done with a function as it is registered and unregistered; return the function."""
    _declared.setdefault(of.__module__, {})[f"{of.__qualname__} {what}"] = Hook(_CALLS, add, remove)
    return of


def attach(module: str, owner: Any, name: str, made: Callable[[], Any]) -> None:
    """Give a type of Blender's a property; made: makes it, at registration."""
    hook = Hook(_PROPERTIES, lambda: setattr(owner, name, made()), lambda: delattr(owner, name))
    _declared.setdefault(module, {})[name] = hook


def property_of(owner: Any, name: str) -> Callable[[type], type]:
    """A property group that is the property `name` of a type such as bpy.types.Object.

    Values stay in the file when the extension is removed, and are found when it is installed again.
    """

    def mark(cls: type) -> type:
        attach(cls.__module__, owner, name, lambda: PointerProperty(type=cls))
        return cls

    return mark


def handler(*events: str) -> Callable[[Any], Any]:
    """An application handler of events, lists in `bpy.app.handlers`; loading a file does not drop it."""

    def mark(function: Any) -> Any:
        persistent(function)
        for event in events:
            listed = getattr(bpy.app.handlers, event)
            _declare(
                function,
                lambda listed=listed: listed.append(function),
                lambda listed=listed: function in listed and listed.remove(function),
                event,
            )
        return function

    return mark


def connected(signal: Signal) -> Callable[[Any], Any]:
    """A function that a signal calls."""

    return lambda function: _declare(
        function, lambda: signal.connect(function), lambda: signal.disconnect(function), "signal"
    )


def menu(name: str, first: bool = False) -> Callable[[Any], Any]:
    """A function that adds to what a menu, a header or a panel draws, at its end or first."""

    how = "prepend" if first else "append"
    return lambda function: _declare(
        function,
        lambda: getattr(getattr(bpy.types, name), how)(function),
        lambda: getattr(bpy.types, name).remove(function),
        name,
    )


def button(*places: str, icon: str = "NONE") -> Callable[[Any], Any]:
    """An operator, a class or a function, with a button at the end of panels and menus of these names."""

    def mark(made: Any) -> Any:
        name = _idname(made)

        def draw(self: Any, context: Any) -> None:
            self.layout.operator(name, icon=icon)

        draw.__module__, draw.__qualname__ = made.__module__, made.__name__
        for place in places:
            menu(place)(draw)
        return made

    return mark


def overlay(function: Any) -> Any:
    """A function that draws over every 3D viewport; not in background."""
    handles: list[Any] = []

    def add() -> None:
        if not bpy.app.background:
            handles.append(bpy.types.SpaceView3D.draw_handler_add(function, (), "WINDOW", "POST_PIXEL"))

    def remove() -> None:
        while handles:
            bpy.types.SpaceView3D.draw_handler_remove(handles.pop(), "WINDOW")

    return _declare(function, add, remove)


class Timer:
    """A function that Blender calls later, and again after the seconds that it returns; see `timer`."""

    def __init__(self, function: Callable[[], float | None], lasts: bool) -> None:
        self.function, self._lasts = function, lasts

    def __call__(self) -> float | None:
        return self.function()

    def soon(self, seconds: float = 0.0) -> None:
        """Have it called after so many seconds, if it does not wait already."""
        if not bpy.app.timers.is_registered(self.function):
            bpy.app.timers.register(self.function, first_interval=seconds, persistent=self._lasts)

    def cancel(self) -> None:
        """Have it called no more."""
        if bpy.app.timers.is_registered(self.function):
            bpy.app.timers.unregister(self.function)


def timer(lasts: bool = False, after_s: float | None = None) -> Callable[[Any], Timer]:
    """A function that Blender calls later: `soon`, and after so many seconds from registration if given.

    lasts: loading a file does not end it.
    """

    def mark(function: Any) -> Timer:
        made = Timer(function, lasts)
        _declare(function, _nothing if after_s is None else lambda: made.soon(after_s), made.cancel)
        return made

    return mark


def at_start(function: Any) -> Any:
    """A function that is called when the extension is registered."""
    return _declare(function, function, what="start")


def at_end(function: Any) -> Any:
    """A function that is called when it is unregistered."""
    return _declare(function, remove=function, what="end")

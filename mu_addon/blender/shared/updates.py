"""Updates after a change: signals to which drawing modules connect, and a pause for setting many values.

Blender fixes a property's update function with its class. A signal lets that function reach the drawing
module without importing it: that module connects when it is registered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_pauses = 0


class Signal:
    """Calls every connected function with the root object that has changed."""

    def __init__(self) -> None:
        self._connected: list[Callable[[Any], Any]] = []

    def connect(self, function: Callable[[Any], Any]) -> None:
        """Call a function from now on."""
        self._connected.append(function)

    def disconnect(self, function: Callable[[Any], Any]) -> None:
        """Stop calling it."""
        if function in self._connected:
            self._connected.remove(function)

    def send(self, root: Any) -> None:
        """Call every connected function, in the order of connection.

        Nothing is returned: Blender takes a property's update function that returns a value for an error.
        """
        self.answers(root)

    def answers(self, root: Any) -> list[Any]:
        """What every connected function returns, in the order of connection."""
        return [function(root) for function in self._connected]


@contextmanager
def paused() -> Iterator[None]:
    """Context in which setting properties starts no rebuild; the body does that itself."""
    global _pauses
    _pauses += 1
    try:
        yield
    finally:
        _pauses -= 1


def are_paused() -> bool:
    """Return True while properties are being set that must start no rebuild."""
    return _pauses > 0

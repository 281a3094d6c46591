"""Generators that yield what they ask for, are sent the answers, and return a value."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TypeVar

Asked = TypeVar("Asked")
Answer = TypeVar("Answer")
Value = TypeVar("Value")


def value_of(asking: Generator[Asked, Answer, Value], answer: Callable[[Asked], Answer]) -> Value:
    """The value that a generator returns once each thing it yields is answered.

    >>> def doubled():
    ...     return 2 * (yield "a number")
    >>> value_of(doubled(), len)
    16
    """
    try:
        asked = next(asking)
        while True:
            asked = asking.send(answer(asked))
    except StopIteration as end:
        found: Value = end.value
        return found

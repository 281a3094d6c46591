"""Names of channels in labels and JSON: which to trust where a name may have been damaged in transfer."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Sequence

import attrs

from .formats import ENOUGH, SURE
from .samples import Layout
from .text_lines import CLOCKS, NUMBERS, Pairs

# A name that is new must come this often within so many lines; more, if its line lacks nothing else.
_NEW_WITHIN, _MORE_WITHIN = 12, 64
_MOST_NEW = 1000


def channels_of(found: Iterable[object]) -> list[str]:
    """Names other than running number and clock; none for a row of numbers."""
    return [name for name in found if isinstance(name, str) and name not in NUMBERS and name not in CLOCKS]


class ChannelNames:
    """Names of a line's values: those that are channels, and those that may be damaged."""

    def __init__(self) -> None:
        self._doubtful: set[str] = set()
        self._new: dict[str, deque[int]] = {}

    def forget_new(self) -> None:
        """Restart with names that are to become channels."""
        self._new = {}

    def is_unsure(self, lines: Sequence[Pairs]) -> bool:
        """True if the first lines are too few and too different to recognise a damaged name."""
        names = Counter(name for line in lines for name in channels_of(line))
        return len(lines) < SURE and any(2 * times <= max(names.values()) for times in names.values())

    def learn(self, lines: Sequence[Pairs], layout: Layout | None) -> Layout | None:
        """Learn the layout that most lines agree on, so that a damaged first line does not set it.

        layout: the present one, which stays if there is one.
        """
        sets = Counter(tuple(channels_of(line)) for line in lines)
        names = Counter(name for line in lines for name in channels_of(line))
        commonest = max(names.values(), default=0)
        self._doubtful = {name for name, times in names.items() if 2 * times < commonest}
        if layout is None and sets:
            most, times = sets.most_common(1)[0]
            if len(most) > 1 and 4 * times >= 3 * len(lines):
                return Layout(most)
        return layout

    def trust(self) -> None:
        """Trust every name."""
        self._doubtful = set()

    def strange(self, names: list[str], layout: Layout | None, number: int) -> tuple[set[str], Layout | None]:
        """Names that are not channels so far, and the layout with those that became channels.

        Those that keep coming do. number: of the line that holds them.
        """
        if layout is None:
            doubtful = {name for name in names if name in self._doubtful}
            self._doubtful -= {name for name in doubtful if self._keeps_coming(name, number, _NEW_WITHIN)}
            return doubtful & self._doubtful, None
        known = set(layout.channels)
        unknown = [name for name in names if name not in known]
        within = _NEW_WITHIN + 3 * len(known) if known - set(names) else _MORE_WITHIN
        strange = set()
        for name in unknown:
            if self._keeps_coming(name, number, within):
                layout = attrs.evolve(layout, channels=(*layout.channels, name))
            else:
                strange.add(name)
        if len(self._new) > _MOST_NEW:
            old = number - _MORE_WITHIN
            self._new = {name: came for name, came in self._new.items() if came[-1] > old}
        return strange, layout

    def _keeps_coming(self, name: str, number: int, within: int) -> bool:
        """True if a new name, on line `number` again, has come ENOUGH times `within` so many lines."""
        came = self._new.setdefault(name, deque(maxlen=ENOUGH))
        came.append(number)
        if len(came) < ENOUGH or came[-1] - came[0] > within:
            return False
        del self._new[name]
        return True

"""The tasks as a table in words: who has which strip, what it may remove, and how the latest ones ended."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass

import rerun as rr

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import StripStatus, TaskState, TaskStatus
from comms.strip_books import state_in_words
from viz import paths
from viz.canvas import Canvas, Pace

MOST_ENDED = 12  # the whole table is written at each change: those that ended long ago are in the log
IN_HAND = (TaskState.ACCEPTED, TaskState.UNDER_WAY)
STANDING = ("open", "in hand", "left", "failed")
HEAD = "| vehicle | strip | state | risk to remove | ends |\n|---|---|---|---|---|"


@dataclass(frozen=True)
class _Row:
    vehicle: str
    status: TaskStatus
    time_ms: int


class TaskTable:
    """Writes the table anew whenever a task or the count of strips changes, once for all that is said at one time."""

    def __init__(self, canvas: Canvas, run: RunInfo) -> None:
        self._column = canvas.column(paths.TASKS, _documents)
        self._in_hand: dict[str, _Row | None] = {one.vehicle: None for one in run.vehicles if one.role.revisits}
        self._ended: deque[_Row] = deque(maxlen=MOST_ENDED)
        self._strips: dict[int, StripStatus] = {}
        self._counts: Counter[str] = Counter()
        self._foreseen: Counter[str] = Counter()
        self._pace = Pace(0)
        self._pace.note(0)

    def on_strip(self, received: Received, strip: StripStatus) -> None:
        """Counts the strip in its state."""
        number = received.number
        before = self._strips.get(number)
        self._strips[number] = strip
        if before is None or (_word(before), before.foreseen) != (_word(strip), strip.foreseen):
            self._count(strip, 1)
            if before is not None:
                self._count(before, -1)
            self._pace.note(received.header.sent_ms)

    def _count(self, strip: StripStatus, more: int) -> None:
        self._counts[_word(strip)] += more
        if strip.foreseen:
            self._foreseen[_word(strip)] += more

    def on_task_status(self, received: Received, status: TaskStatus) -> None:
        """Takes the vehicle's word on its task."""
        row = _Row(received.vehicle, status, received.header.sent_ms)
        before = self._in_hand.get(received.vehicle)
        if status.state in IN_HAND:
            self._in_hand[received.vehicle] = row
        elif before is not None and before.status.strip == status.strip:
            self._in_hand[received.vehicle] = None
            self._ended.appendleft(row)
        elif status.state is TaskState.REFUSED:
            self._ended.appendleft(row)
        else:  # said again
            return
        if before is None or (before.status.strip, before.status.state) != (status.strip, status.state):
            self._pace.note(received.header.sent_ms)

    def advance(self, time_ms: int) -> None:
        """Writes the table if all that was said at the time of its last change is in."""
        self._write(self._pace.due(time_ms))

    def finish(self) -> None:
        """Writes the table if it has changed."""
        self._write(self._pace.rest())

    def _write(self, changed_ms: int | None) -> None:
        if changed_ms is not None:
            self._column.add(changed_ms, self._words())

    def _words(self) -> str:
        if not self._in_hand:
            return "No vehicle takes a second look."
        rows = [
            f"| {vehicle} | | free | | |" if row is None else self._line(row)
            for vehicle, row in sorted(self._in_hand.items())
        ]
        rows += map(self._line, self._ended)
        head = [f"Strips: {_counted(self._counts)}", ""]
        if self._foreseen:
            of_them = _counted(self._foreseen)
            head += [f"Foreseen, expected to be badly seen and not found so, blue while open: {of_them}", ""]
        return "\n".join([*head, HEAD, *rows])

    def _line(self, row: _Row) -> str:
        status = row.status
        strip = self._strips.get(status.strip)
        risk = f"{strip.removable_m2:.0f} m²" if strip and status.state in IN_HAND else ""
        ends = f"about {status.ends_ms / 1000:.0f} s" if status.state in IN_HAND else f"{row.time_ms / 1000:.0f} s"
        state = status.state.value.replace("_", " ")
        return f"| {row.vehicle} | {status.strip} | {state} | {risk} | {ends} |"


def _word(strip: StripStatus) -> str:
    return "in hand" if strip.state.is_taken else state_in_words(strip)


def _counted(counts: Counter[str]) -> str:
    """As a person counts: what was withdrawn is no place any more, or one with others."""
    places = sum(counts[word] for word in (*STANDING, "done"))
    rest = "".join(f", {counts[word]} {word}" for word in STANDING if counts[word])
    return f"{counts['done']} of {places} places seen again{rest}"


def _documents(texts: Sequence[str]) -> rr.ComponentColumnList:
    return rr.TextDocument.columns(text=texts, media_type=[rr.MediaType.MARKDOWN] * len(texts))

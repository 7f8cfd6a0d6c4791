"""The recorder: listens to a run and writes it as a Rerun recording that shows the mission from above, over time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import rerun as rr

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import (
    AgentState,
    Contact,
    CoverageTile,
    Curve,
    Hotspot,
    Message,
    MissionOver,
    Nav,
    Plan,
    TaskStatus,
    TruthLook,
    TruthPose,
    TruthTargets,
)
from comms.strip_books import StripBooks
from viz import palette, paths
from viz.blueprint import mission_blueprint
from viz.canvas import Canvas
from viz.curves import Curves
from viz.fleet import Fleet
from viz.link import Link
from viz.mines import Mines
from viz.recorder_config import LogLine, RecorderConfig
from viz.risk_map import RiskMap, put_priorities
from viz.second_looks import SecondLooks
from viz.shapes import extent_of
from viz.task_table import TaskTable
from viz.truth import Truth


class Recorder:
    """Writes `config.path` (comms.node.Listener). The file is complete after `close`; what was written before a process
    is killed stays readable.

    Everything drawn comes from the messages; what comes before the run's first message is kept until that is there.
    """

    def __init__(self, config: RecorderConfig) -> None:
        run = config.path.absolute().parent.name  # recordings of one id open as one
        self._canvas = Canvas(config.path, run, config.live_pipe)
        self._config = config
        self._mission: _Mission | None = None
        self._early: list[Received] = []

    def on_message(self, received: Received) -> None:
        """Draws one message of the run."""
        if self._mission is not None:
            self._mission.draw(received)
        elif isinstance(received.message, RunInfo):
            self._mission = _Mission(self._canvas, received.message, self._config)
            self._mission.draw(received)
            for early in self._early:
                self._mission.draw(early)
            self._early = []
        else:
            self._early.append(received)

    def close(self) -> None:
        """Writes what is held and completes the file."""
        if self._mission is not None:
            self._mission.finish()
        self._canvas.close()


class _Mission:
    """Everything that is drawn of one mission, once area, grid and roster are known."""

    def __init__(self, canvas: Canvas, run: RunInfo, config: RecorderConfig) -> None:
        self._canvas = canvas
        extent = extent_of(run)
        told = rr.AnyValues(scenario=run.scenario, seed=run.seed)
        canvas.present(run.scenario, mission_blueprint(extent, run, has_link=config.link is not None), told)
        self._map = RiskMap(canvas, run, extent, round(config.draw_every_s * 1000))
        put_priorities(canvas, config.priorities)
        self._mines = Mines(canvas, self._map.map, self._map.inside)
        self._story = config.story()
        self._table = TaskTable(canvas, run)
        self._second_looks = SecondLooks(canvas, extent)
        self._books = StripBooks()
        self._time_ms = -1
        self._fleet, self._truth = fleet, truth = Fleet(canvas, run, extent), Truth(canvas)
        curves = Curves(canvas, run, config.thresholds)
        self._draw: dict[type[Message], tuple[Callable[[Received, Any], None], ...]] = {
            CoverageTile: (self._map.on_tile,),
            Nav: (fleet.on_nav,),
            Plan: (fleet.on_plan, curves.on_plan),
            AgentState: (fleet.on_state,),
            TaskStatus: (fleet.on_task_status, self._table.on_task_status),
            Contact: (fleet.on_contact, self._mines.on_contact),
            Hotspot: (self._second_looks.on_hotspot,),
            Curve: (curves.on_curve, self._mines.on_curve),
            TruthTargets: (truth.on_targets,),
            TruthLook: (truth.on_look,),
            TruthPose: (truth.on_pose,),
            MissionOver: (self._on_over,),
        }
        self._draw |= dict.fromkeys(StripBooks.telling, (self._on_strips,))
        self._link = None if config.link is None else Link(canvas, run, config.link())
        for one in () if self._link is None else self._link.telling:
            assert self._link is not None
            self._draw[one] = (*self._draw.get(one, ()), self._link.on_message)
        for one in self._story.telling:
            self._draw[one] = (*self._draw.get(one, ()), self._tell)

    def draw(self, received: Received) -> None:
        if received.header.sent_ms != self._time_ms:
            self._advance(received.header.sent_ms)
        for draw in self._draw.get(type(received.message), ()):
            draw(received, received.message)

    def _on_over(self, received: Received, over: MissionOver) -> None:
        """Vehicles are drawn no farther, unless they tell of courses after it."""
        self._fleet.finish(received.header.sent_ms)
        self._truth.finish(received.header.sent_ms)

    def _advance(self, time_ms: int) -> None:
        self._time_ms = time_ms
        self._fleet.advance(time_ms)
        self._truth.advance(time_ms)
        self._mines.advance(time_ms)
        self._map.advance(time_ms)
        self._second_looks.advance(time_ms)
        self._table.advance(time_ms)
        self._put_lines(self._story.rest(before_ms=time_ms))
        self._canvas.advance()

    def finish(self) -> None:
        self._fleet.finish(self._time_ms)
        self._truth.finish(self._time_ms)
        self._map.finish()
        self._mines.finish(self._time_ms)
        self._second_looks.finish()
        self._table.finish()
        if self._link is not None:
            self._link.finish(self._time_ms)
        self._put_lines(self._story.rest())

    def _on_strips(self, received: Received, message: Message) -> None:
        for one in self._books.hear(received):
            self._second_looks.on_strip(one, one.message)
            self._table.on_strip(one, one.message)

    def _tell(self, received: Received, message: Message) -> None:
        self._put_lines(self._story.tell(received))

    def _put_lines(self, lines: Iterable[LogLine]) -> None:
        for time_ms, sender, words, warns in lines:
            path, text = f"{paths.LOG}/{sender}", f"{sender}: {words}"
            if warns:
                warning = rr.TextLog(text, level=rr.TextLogLevel.WARN, color=palette.WARNING)
                self._canvas.put(time_ms, path, warning)
            else:
                self._canvas.column(path, _plain_lines).add(time_ms, text)


def _plain_lines(texts: Sequence[str]) -> rr.ComponentColumnList:
    # They have no colour of their own, so that they are legible in a light viewer and in a dark one.
    return rr.TextLog.columns(text=texts, level=[rr.TextLogLevel.INFO] * len(texts))

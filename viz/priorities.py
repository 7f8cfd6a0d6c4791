"""Ground whose risk counts for more or less in second looks, from above: where it lies, and how often it counts."""

from __future__ import annotations

from collections.abc import Sequence

import rerun as rr

from comms.said.messages import Vertex
from planner.types import PriorityGround
from viz import palette, paths
from viz.canvas import Canvas
from viz.shapes import OUTLINE_Z_M, ring


def put_priorities(canvas: Canvas, priorities: Sequence[PriorityGround]) -> None:
    """Draws each under its own entity, with what it counts."""
    for number, one in enumerate(priorities, start=1):
        canvas.put_static(
            f"{paths.PRIORITIES}/{number}",
            rr.LineStrips3D(
                [ring([Vertex(*corner) for corner in outline], OUTLINE_Z_M) for outline in one.outlines_m],
                colors=[palette.PRIORITY],
                radii=rr.Radius.ui_points(1.5),
                labels=f"risk counts {one.weight:g} times here",
                show_labels=True,
            ),
        )

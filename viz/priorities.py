"""Ground whose risk counts for more or less in second looks, from above: where it lies, and how often it counts."""

from __future__ import annotations

from collections.abc import Sequence

import rerun as rr

from comms.messages import Vertex
from viz import palette, paths
from viz.canvas import Canvas
from viz.recorder_config import PriorityGround
from viz.shapes import OUTLINE_Z_M, ring


def put_priorities(canvas: Canvas, priorities: Sequence[PriorityGround]) -> None:
    """Draws each as an outline that tells its weight; nothing where there are none."""
    if priorities:
        canvas.put_static(
            paths.PRIORITIES,
            rr.LineStrips3D(
                [ring([Vertex(*corner) for corner in one.polygon_m], OUTLINE_Z_M) for one in priorities],
                colors=[palette.PRIORITY],
                radii=rr.Radius.ui_points(1.5),
                labels=[f"risk counts {one.weight:g} times here" for one in priorities],
                show_labels=True,
            ),
        )

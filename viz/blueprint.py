"""What a mission's recording looks like when it is opened: the map, the curves over time, who does what, the log."""

from __future__ import annotations

import math
from collections.abc import Sequence

import rerun.blueprint as rrb

from comms.said.announcement import RunInfo
from viz import palette, paths
from viz.shapes import Extent

FIELD_OF_VIEW_RAD = math.radians(55.0)  # vertical, of the viewer's camera
MARGIN = 1.18  # room around the area for turns and the colour scale
WIDE_VIEW, TALL_VIEW = 3.0, 0.9  # width over height of the map's view in either layout


def mission_blueprint(extent: Extent, run: RunInfo, *, has_link: bool = False) -> rrb.Blueprint:
    """The blueprint for an area: a wide one lies above the other views, a tall one beside them. `has_link`: with views
    of the link, and ranges and P(y) in one place."""
    wide = extent.width_m > 1.5 * extent.height_m
    area = _map_view(extent, [one.vehicle for one in run.vehicles], WIDE_VIEW if wide else TALL_VIEW)
    curves = _curve_views([one.vehicle for one in run.vehicles if one.role.surveys])
    below: rrb.Container | rrb.View = _ranges_view()
    beside: rrb.Container | rrb.View = curves
    if has_link:
        below = rrb.Tabs(_ranges_view(), curves)
        ages, sent = rrb.Tabs(*_ages_views()), rrb.Tabs(_bytes_view(), _subjects_view(), _shares_view())
        beside = rrb.Vertical(ages, sent, row_shares=[4, 3])
    log = _log_view()
    over_time = rrb.Tabs(_metrics_view(), _mines_view(), _clearance_view())
    if wide:
        layout: rrb.Container = rrb.Vertical(
            area,
            rrb.Horizontal(
                rrb.Vertical(over_time, below, row_shares=[4, 3]),
                beside,
                rrb.Vertical(_activity_view(), _tasks_view()),
                log,
                column_shares=[5, 4, 5, 6],
            ),
            row_shares=[9, 8],
        )
    else:
        column = rrb.Vertical(
            rrb.Horizontal(rrb.Vertical(over_time, below, row_shares=[4, 3]), beside),
            rrb.Horizontal(_activity_view(), _tasks_view()),
            log,
            row_shares=[5, 4, 4],
        )
        layout = rrb.Horizontal(area, column, column_shares=[1, 1])
    return rrb.Blueprint(
        layout,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=paths.TIMELINE),
        auto_layout=False,
        auto_views=False,
    )


def _map_view(extent: Extent, vehicles: Sequence[str], aspect: float) -> rrb.Spatial3DView:
    x_m, y_m = extent.centre
    height_m = MARGIN * max(extent.height_m * 1.25, extent.width_m / aspect) / (2 * math.tan(FIELD_OF_VIEW_RAD / 2))
    # Of these each entry adds to those before, so the view shows all up to the time cursor.
    adding = [paths.TRUTH_DETECTED]
    adding += [f"{root}/{vehicle}" for root in (paths.FLOWN, paths.CONTACTS) for vehicle in vehicles]
    so_far = rrb.VisibleTimeRanges(
        timeline=paths.TIMELINE, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
    )
    return rrb.Spatial3DView(
        origin="/",
        name="Area from above: residual risk, grey where nobody has looked yet",
        contents=[f"+ {root}/**" for root in (
            "/area", paths.PLAN, paths.FLOWN, paths.HOTSPOTS, paths.STRIPS, paths.CONTACTS, paths.FLEET, paths.TRUTH
        )],
        overrides={
            paths.TRUTH: rrb.EntityBehavior(visible=False),
            # What is under the pointer is the risk.
            paths.UNSEEN: rrb.EntityBehavior(interactive=False),
            **dict.fromkeys(adding, so_far),
        },
        background=rrb.Background(kind=rrb.BackgroundKind.SolidColor, color=palette.BACKGROUND),
        line_grid=rrb.LineGrid3D(visible=False),
        # Not quite straight down: the camera needs to know which way is up.
        eye_controls=rrb.EyeControls3D(
            position=(x_m, y_m - 0.001 * height_m, height_m), look_target=(x_m, y_m, 0.0), eye_up=(0.0, 1.0, 0.0)
        ),
    )  # fmt: skip


def _whole_mission() -> rrb.TimeAxis:
    return rrb.TimeAxis(
        view_range=rrb.TimeRange(start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.infinite())
    )


def _series_view(
    origin: str,
    name: str,
    legend: rrb.Corner2D | None,
    *,
    are_shares: bool = False,
    contents: Sequence[str] = ("$origin/**",),
) -> rrb.TimeSeriesView:
    """Series over the whole mission: all below `origin`, or of the paths in `contents`."""
    return rrb.TimeSeriesView(
        origin=origin,
        contents=[f"+ {path}" for path in contents],
        name=name,
        axis_x=_whole_mission(),
        axis_y=rrb.ScalarAxis(range=(0.0, 1.0)) if are_shares else None,
        plot_legend=rrb.PlotLegend(visible=False) if legend is None else rrb.PlotLegend(legend),
    )


def _metrics_view() -> rrb.TimeSeriesView:
    return _series_view(paths.METRICS, "Risk and coverage over time", rrb.Corner2D.LeftBottom, are_shares=True)


def _mines_view() -> rrb.TimeSeriesView:
    return _series_view(paths.MINES, "Mines", rrb.Corner2D.RightTop)


def _clearance_view() -> rrb.TimeSeriesView:
    return _series_view(paths.CLEARANCE, "Clearance", rrb.Corner2D.LeftTop, are_shares=True)


def _log_view() -> rrb.TextLogView:
    body = rrb.encodings.TextLogColumn(rrb.encodings.TextLogColumnKind.Body)
    return rrb.TextLogView(origin=paths.LOG, name="Log", columns=rrb.TextLogColumns(text_log_columns=[body]))


def _ranges_view() -> rrb.TimeSeriesView:
    return _series_view(paths.RANGES, "Range in metres: r_eff, and what is planned for", rrb.Corner2D.RightTop)


def _ages_views() -> list[rrb.TimeSeriesView]:
    names = {paths.LINK_AGES: "Age in s of what is known", paths.LINK_AGES_OF_HUB: "Of the coordinator’s words"}
    return [_series_view(path, name, rrb.Corner2D.LeftTop) for path, name in names.items()]


def _bytes_view() -> rrb.TimeSeriesView:
    return _series_view(paths.LINK, "Bytes a second", None, contents=[paths.LINK_BYTES])


def _subjects_view() -> rrb.TimeSeriesView:
    return _series_view(paths.LINK_BYTES_FOR, "For what", rrb.Corner2D.RightTop)


def _shares_view() -> rrb.TimeSeriesView:
    contents = [paths.LINK_LOST, paths.LINK_FULL]
    return _series_view(
        paths.LINK, "Frames lost, slots full", rrb.Corner2D.RightTop, are_shares=True, contents=contents
    )


def _curve_views(surveyors: Sequence[str]) -> rrb.BarChartView | rrb.Tabs:
    views = [
        rrb.BarChartView(
            origin=f"{paths.CURVE}/{vehicle}",
            name=f"P(y) of {vehicle}'s latest track",
            plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
        )
        for vehicle in surveyors
    ]
    return views[0] if len(views) == 1 else rrb.Tabs(*views)


def _tasks_view() -> rrb.TextDocumentView:
    return rrb.TextDocumentView(origin=paths.TASKS, name="Tasks")


def _activity_view() -> rrb.StateTimelineView:
    return rrb.StateTimelineView(origin=paths.ACTIVITY, name="Who does what", time_view=_whole_mission())

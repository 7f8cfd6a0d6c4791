"""What the profile of a modem must hold to, be it a file's keys or what a class of the user's makes."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from secondlook.errors import UserError
from secondlook.fleet.link import link_times, modem_configs, signal_of
from secondlook.scenario import Profile, Scenario, bundled
from secondlook.scenario.link import IDEAL
from secondlook.scenario.plug_ins import PROFILE
from secondlook.testing.checks.examples import PATIENCE_S, Checked
from secondlook.testing.fleet import scenario_from
from sim_world.channel_config import Signal

_RANGES = 500  # at which it is asked for the share of frames lost
_NEAR_M = 1.0


def check_modem_profile(
    profile: Any, *, fleet: str | os.PathLike[str] | Scenario = "tellaro", patience_s: float = PATIENCE_S
) -> None:
    """Checks the profile of a modem: a bundled one's name, a YAML file, its keys, or a class or function that makes
    them when it is called without arguments, also as `package.module:Class`.

    Its keys are those of `link.profile`, and the same each time they are made, within `patience_s` of wall time. A
    packet takes longer than nothing, and no less with more frames. Of the frames a share from 0 to 1 is lost, never
    less farther off, not all of them close by, and all beyond `max_range_m`; the same share each time. For the fleet of
    a scenario, `fleet`, frames have room for what is said, a slot has time for a packet and its way, and a cycle is
    short enough for messages to tell when they were said. AssertionError tells the first that it does not keep to.
    """
    __tracebackhide__ = True
    name, keys = _keys(profile, patience_s)
    try:
        flown = scenario_from(fleet).model_dump(mode="json", exclude_none=True)
        scenario = scenario_from({**flown, "link": {"profile": keys}})
    except UserError as error:
        raise AssertionError(f"{name}: {error}") from error
    if scenario.link is None:
        raise AssertionError(f"{name}: is the ideal link, which has no modems; must be a modem's profile")
    signal = signal_of(scenario.link.modem)
    _check_packets(name, signal)
    _check_loss(name, signal)
    _check_slots(name, scenario)


def _keys(profile: Any, patience_s: float) -> tuple[str, Any]:
    """What it is called, and what a scenario holds for it."""
    if isinstance(profile, Profile):
        return profile.name, profile.model_dump(mode="json", exclude_none=True)
    if isinstance(profile, Mapping):
        return str(profile.get("name", "the profile")), dict(profile)
    is_file = isinstance(profile, os.PathLike) or (isinstance(profile, str) and ":" not in profile)
    if is_file:
        path = os.fspath(profile)
        return path, path if path in (IDEAL, *bundled.link_names()) else os.path.abspath(path)
    checked = Checked(PROFILE, profile, patience_s)
    made: list[Any] = []
    checked.watched(lambda: made.extend(checked.make() for _ in range(2)))
    first, second = made
    if not isinstance(first, dict):
        raise AssertionError(f"{checked.name} must make a profile's keys as a dict, not {first!r}")
    if first != second:
        raise AssertionError(f"{checked.name} makes another profile each time")
    return checked.name, first


def _check_packets(name: str, signal: Signal) -> None:
    durations_ms = [signal.packet_ms(frames) for frames in range(1, signal.frames + 1)]
    for frames, lasts_ms in enumerate(durations_ms, start=1):
        if not 0 < lasts_ms < math.inf or lasts_ms < durations_ms[max(0, frames - 2)]:
            raise AssertionError(f"{name}: a packet of {frames} frames takes {lasts_ms} ms; must be more than fewer do")


def _check_loss(name: str, signal: Signal) -> None:
    before_m, before = 0.0, 0.0
    for range_m in (0.0, *np.geomspace(_NEAR_M, signal.max_range_m, _RANGES).tolist(), signal.max_range_m + 1.0):
        share = signal.share_lost(range_m)
        told = f"{name}: of the frames {share:.3f} are lost at {range_m:.0f} m"
        if not 0.0 <= share <= 1.0:
            raise AssertionError(f"{told}; must be a share, 0 to 1")
        if share < before:
            raise AssertionError(f"{told}, and {before:.3f} at {before_m:.0f} m; must not be less farther off")
        if signal.share_lost(range_m) != share:
            raise AssertionError(f"{told}, and another share when it is asked again")
        if range_m <= _NEAR_M and share == 1.0:
            raise AssertionError(f"{told}: nothing would ever be heard")
        before_m, before = range_m, share


def _check_slots(name: str, scenario: Scenario) -> None:
    times = link_times(scenario)
    assert times is not None
    try:
        modem_configs(scenario)
    except ValueError as error:
        raise AssertionError(f"{name}: {error}") from error
    if times.slot_ms < times.packet_ms[-1] + times.way_ms:
        raise AssertionError(
            f"{name}: a slot of {times.slot_ms} ms has no time for a packet, {times.packet_ms[-1]} ms, and its way, "
            f"{times.way_ms} ms"
        )

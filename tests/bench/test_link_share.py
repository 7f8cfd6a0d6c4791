"""The share of an ideal link's gain that another keeps, by hand."""

from __future__ import annotations

from typing import Any

import pytest

from bench.link_share import shares


def row(profile: str, seed: int, mean: float, *, alone: float = 0.6, platform: str = "ship") -> dict[str, Any]:
    return {
        "scenario": "toy", "seed": seed, "link.profile": profile, "platform": platform, "failure": None,
        "risk.mean": mean, "risk_primary_alone.mean": alone, "risk_at.1.mean": None,
        "risk.worst30_mean": mean, "risk_primary_alone.worst30_mean": 1.0, "risk_at.1.worst30_mean": None,
    }  # fmt: skip


def test_each_mission_is_held_against_that_of_its_own_seed() -> None:
    rows = [row("ideal", 1, 0.4), row("janus", 1, 0.5), row("ideal", 2, 0.2), row("janus", 2, 0.3, alone=0.7)]
    found = shares(rows, ["link.profile"])
    assert [share for _, share in found[("ideal",)]] == pytest.approx([1.0, 1.0])
    assert [share for _, share in found[("janus",)]] == pytest.approx([0.5, 1.0])
    of_worst = shares(rows, ["link.profile"], "worst30_mean")
    assert [share for _, share in of_worst[("janus",)]] == pytest.approx([5 / 6, 7 / 8])


def test_the_risk_at_105_of_the_primarys_time_counts_where_the_mission_lasts_longer() -> None:
    rows = [row("ideal", 1, 0.4) | {"risk_at.1.mean": 0.4}, row("janus", 1, 0.3) | {"risk_at.1.mean": 0.45}]
    assert [share for _, share in shares(rows, ["link.profile"])[("janus",)]] == pytest.approx([0.75])


def test_and_of_its_own_platform() -> None:
    rows = [row("ideal", 1, 0.4), *(row(profile, 1, 0.5, platform="primary") for profile in ("ideal", "radio"))]
    found = shares(rows, ["link.profile", "platform"])
    assert [share for _, share in found["radio", "primary"]] == pytest.approx([1.0])


def test_the_ideal_link_has_no_other_keys_that_are_varied_of_links() -> None:
    rows = [
        row("ideal", 1, 0.4),
        *(row("radio", 1, mean) | {"link.access": one} for one, mean in (("slots", 0.5), ("polled", 0.45))),
    ]
    found = shares(rows, ["link.profile", "link.access"])
    assert {key: [share for _, share in one] for key, one in found.items()} == {
        ("ideal", "-"): [1.0],
        ("radio", "slots"): pytest.approx([0.5]),
        ("radio", "polled"): pytest.approx([0.75]),
    }


def test_what_failed_and_where_nothing_was_to_be_removed_is_left_out() -> None:
    failed = row("radio", 1, 0.4) | {"failure": "node died", "risk.mean": None}
    rows = [row("ideal", 1, 0.4), failed, row("ideal", 2, 0.6), row("radio", 2, 0.6)]
    assert [len(one) for one in shares(rows, ["link.profile"]).values()] == [1]
    with pytest.raises(ValueError, match=r"no mission was flown with link\.profile=ideal"):
        shares([failed], ["link.profile"])

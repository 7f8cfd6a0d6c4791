"""The link of a scenario: profiles that are bundled, of a file or made by a user's own, and what is kept of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from secondlook.fleet.link import signal_of
from secondlook.scenario import Profile, Scenario, bundled, load_scenario, make_scenario, scenario_hash
from secondlook.scenario.errors import ScenarioError
from secondlook.scenario.text import read

OWN = """\
name: own
frame_bits: 80
rate_bps: 100
max_range_m: 3000
loss: {range_m: [0, 3000], share: [0, 0.5]}
"""


def profile_of(name: str) -> Profile:
    return Profile.model_validate(bundled.link(name))


def test_without_a_link_a_scenario_is_as_it_was_and_an_ideal_one_is_none() -> None:
    without = load_scenario("tellaro")
    hashed = without.model_dump(mode="json", exclude_none=True)
    assert not hashed.keys() & {"link"}
    assert not hashed["coordinator"].keys() & {"platform", "position"}
    ideal = load_scenario("tellaro", ["link.profile=ideal"])
    assert ideal == without
    assert scenario_hash(load_scenario("tellaro", ["link.profile=janus"])) != scenario_hash(without)


@pytest.mark.parametrize("name", bundled.link_names())
class TestBundledProfiles:
    def test_each_says_what_it_is_and_where_its_figures_are_from(self, name: str) -> None:
        profile = profile_of(name)
        assert profile.name == name
        assert profile.description
        assert profile.source

    def test_a_scenario_with_it_can_be_written_out_and_read_again(self, name: str) -> None:
        scenario = load_scenario(
            "tellaro", [f"link={{profile: {name}, loss: 0.1, outages: [{{from_s: 5, for_s: 9}}]}}"]
        )
        again = make_scenario(read(scenario.to_yaml(), "scenario").data)
        assert again == scenario
        assert Scenario.model_validate(scenario.model_dump()) == scenario
        assert scenario_hash(again) == scenario_hash(scenario)

    def test_little_is_lost_near_and_all_beyond_its_range(self, name: str) -> None:
        signal = signal_of(profile_of(name))
        assert all(signal.share_lost(range_m) <= 0.02 for range_m in (0, 100, 500))
        shares = [signal.share_lost(range_m) for range_m in range(0, int(signal.max_range_m) + 1, 250)]
        assert shares == sorted(shares)
        assert signal.share_lost(signal.max_range_m + 1) == 1.0


@pytest.mark.parametrize(
    ("name", "bits", "frames", "seconds"),
    [
        ("micromodem-0", 256, 1, 3.5),  # 32 bytes at 80 bit/s, and the preamble
        ("micromodem-1", 512, 3, 6.444),  # 192 bytes at 250 bit/s
        ("micromodem-6", 256, 6, 3.25),  # as WHOI's table has it
        ("janus", 34, 1, 1.1),  # 32 and 144 chips of 6.25 ms
        ("unet-control", 128, 1, 0.165),  # 16 bytes at 800 bit/s and 5 ms
        ("unet-data", 512, 1, 0.219),  # 64 bytes at 2400 bit/s and 5 ms
        ("radio", 2048, 4, 0.864),
    ],
)
def test_the_longest_packet_is_as_long_as_its_source_has_it(name: str, bits: int, frames: int, seconds: float) -> None:
    profile = profile_of(name)
    assert (profile.frame_bits, profile.frames) == (bits, frames)
    assert signal_of(profile).packet_ms(frames) == round(seconds * 1000)


@pytest.mark.parametrize(
    ("name", "range_m", "share"), [("micromodem-0", 3000, 1 / 15), ("micromodem-0", 4000, 0.3), ("janus", 5000, 1 / 15)]
)
def test_by_the_sonar_equation_as_much_is_lost_as_its_file_says(name: str, range_m: float, share: float) -> None:
    assert signal_of(profile_of(name)).share_lost(range_m) == pytest.approx(share, rel=0.1)


class TestProfilesOfOnesOwn:
    def test_a_file_is_found_beside_the_scenario_and_kept_with_it(self, tmp_path: Path) -> None:
        (tmp_path / "own.yaml").write_text(OWN)
        (tmp_path / "bay.yaml").write_text(
            load_scenario("tellaro").to_yaml() + "link: {profile: own.yaml, loss: 0.2}\n"
        )
        scenario = load_scenario(tmp_path / "bay.yaml")
        assert scenario.link is not None
        assert scenario.link.modem == Profile.model_validate(read(OWN, "own").data)
        assert make_scenario(read(scenario.to_yaml(), "scenario").data) == scenario

    def test_a_mapping_and_what_makes_one_are_the_same(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        keys = read(OWN, "own").data
        (tmp_path / "water_of_ones_own.py").write_text(f"def modem():\n    return {keys}\n")
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.chdir(tmp_path)
        made = load_scenario("tellaro", ["link.profile=water_of_ones_own:modem"])
        data = load_scenario("tellaro").model_dump(mode="json", exclude_none=True)
        assert make_scenario({**data, "link": {"profile": keys}}) == made


def test_a_single_vehicle_with_the_coordinator_aboard_needs_no_link() -> None:
    data = load_scenario("tellaro").model_dump(mode="json", exclude_none=True)
    del data["vehicles"]["helper"]
    alone = {**data, "coordinator": {"platform": "primary"}, "link": {"profile": "radio"}}
    with pytest.raises(ScenarioError, match="must be left out, as there is one platform, primary, with the coordinat"):
        make_scenario(alone)
    assert make_scenario({**alone, "coordinator": {}}).link is not None

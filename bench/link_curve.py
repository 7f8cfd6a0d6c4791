"""What a link keeps of what second looks remove, over the bits a second that it carries, for three ways to use them.

python -m bench.link_curve KEPT.json OUT.png draws the curve from what is kept in docs/figures/link-curve.json;
`python -m bench.figures --fly link-curve` flies the missions, keeps what came of them, and writes the table.

The modems of the curve differ in nothing but their rate: a packet is one frame of 256 bits, and nothing is lost. Bits a
second are those of a frame over the length of a slot, by whomever it is: the water is shared by all. Each mission ends
when that over the ideal link did, so that no setting is shorter than another.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path
from statistics import fmean

import numpy as np
from matplotlib import pyplot

from bench.flown import Document, some
from bench.rows import head, line
from secondlook.fleet.link import link_times
from secondlook.scenario import load_scenario
from secondlook.testing import Fleet

SCENARIOS = ("tellaro", "two-helpers", "patchy")
SEEDS = (1001, 1002, 1003, 1004)
BITS_PER_S = (5, 10, 20, 40, 80, 160)
FRAME_BITS = 256
SETTINGS = {
    "by age, maps as tiles": ("link.order=age", "link.maps=tiles"),
    "by worth, maps as tiles": ("link.maps=tiles",),
    "by worth, maps as stretches": (),
}
"""What of a link differs between the lines of the curve."""


def modem(rate_bps: float) -> str:
    """The override for a modem of the curve with so many bits a second on the water."""
    keys = f"frame_bits: {FRAME_BITS}, frames: 1, rate_bps: {rate_bps:.3f}, max_range_m: 6000, guard_s: 0.1"
    return f"link.profile={{name: curve, {keys}, loss: {{range_m: [0], share: [0]}}}}"


def overrides(scenario: str, bits_per_s: float, setting: str) -> tuple[str, ...]:
    """Of a mission of the curve. Raises ValueError for more bits a second than leave time for the sound's way."""
    times = link_times(load_scenario(scenario, [modem(1e6)]))
    assert times is not None
    left_s = FRAME_BITS / bits_per_s - times.slot_ms / 1000
    if left_s <= 0:
        raise ValueError(f"{bits_per_s} bits a second are too many: the sound's way takes {times.slot_ms} ms")
    return modem(FRAME_BITS / left_s), *SETTINGS[setting]


def fly() -> Document:
    """Flies all missions of the curve: a row for each."""
    flown = [(scenario, seed) for seed in SEEDS for scenario in SCENARIOS]
    with ProcessPoolExecutor() as pool:
        return {"rows": [row for rows in pool.map(_fly_rates, *zip(*flown, strict=True)) for row in rows]}


def _fly_rates(scenario: str, seed: int) -> list[Document]:
    """All settings at all rates."""
    ideal, rows = _flown(scenario, seed, ()), list[Document]()
    ends = ("mission.deadline_factor=null", f"mission.deadline_s={ideal['time']['mission_s']}")
    alone, left = ideal["risk_primary_alone"]["mean"], ideal["risk"]["mean"]
    for bits_per_s, setting in product(BITS_PER_S, SETTINGS):
        set_ = (*overrides(scenario, bits_per_s, setting), *ends)
        flown = _flown(scenario, seed, set_)
        share = (alone - flown["risk"]["mean"]) / (alone - left)
        row = {"scenario": scenario, "seed": seed, "bits_per_s": bits_per_s, "setting": setting}
        row |= {"share": share, "risk.mean": flown["risk"]["mean"]}
        row |= {"risk.worst30_mean": flown["risk"]["worst30_mean"], "overrides": set_}
        row["bytes_per_s"] = flown["link"]["bytes_per_s"]
        rows.append(some(row, row))
        print(f"{scenario} {seed}, {bits_per_s} bits a second, {setting}: {share:.3f}", flush=True)
    return rows


def _flown(scenario: str, seed: int, set_: Sequence[str]) -> Document:
    with tempfile.TemporaryDirectory() as folder:
        return dict(Fleet(scenario, overrides=set_, seed=seed, folder=Path(folder)).run().summary)


def shares(rows: Iterable[Document]) -> dict[str, dict[int, list[float]]]:
    """By setting and bits a second the shares kept."""
    found: dict[str, dict[int, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        found[row["setting"]][row["bits_per_s"]].append(row["share"])
    return found


def table(rows: Sequence[Document]) -> list[str]:
    """The lines of the table, as Markdown."""
    rates = sorted({row["bits_per_s"] for row in rows})
    lines = head((), ["bits a second", *map(str, rates)])
    for setting, by_rate in shares(rows).items():
        lines.append(line((), [setting, *(f"{fmean(by_rate[one]):.3f}" for one in rates)]))
    return lines


def draw(rows: Sequence[Document], out: Path) -> None:
    """Draws the curve: a line for each setting, and a dot for each mission."""
    figure, axes = pyplot.subplots(figsize=(7.0, 4.0), dpi=120)
    for colour, (setting, by_rate) in zip(("#b0563b", "#8a8a8a", "#1f6f8b"), shares(rows).items(), strict=True):
        rates = sorted(by_rate)
        axes.plot(rates, [fmean(by_rate[one]) for one in rates], color=colour, linewidth=2, label=setting)
        x, y = np.transpose([(one, share) for one in rates for share in by_rate[one]])
        axes.scatter(x, y, color=colour, s=9, alpha=0.5, linewidths=0)
    axes.axhline(1.0, color="#444444", linewidth=0.8, linestyle=":")
    axes.set_xscale("log", base=2)
    axes.set_xticks(BITS_PER_S, labels=list(map(str, BITS_PER_S)))
    axes.set(xlabel="bits a second across the water", ylabel="share kept", ylim=(0.0, 1.1))
    axes.grid(visible=True, color="#e4e4e4", linewidth=0.7)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=9)
    figure.tight_layout()
    figure.savefig(out)
    pyplot.close(figure)


def main(arguments: Sequence[str]) -> None:
    """Draws the curve from the file in which it is kept to another."""
    kept, out = map(Path, arguments)
    draw(json.loads(kept.read_text())["rows"], out)


if __name__ == "__main__":
    main(sys.argv[1:])

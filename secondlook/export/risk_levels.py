"""The map of residual risk as polygons, one feature for each level, and how QGIS is to colour them."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from planner.types import BoolArray
from secondlook.recorded import RiskMap
from secondlook.recorded.geojson import Feature
from secondlook.report.drawing import UNSEEN_COLOUR, viridis

LEVELS = 10
NEVER = "never looked at"
NAMES = (*(f"{index / LEVELS:.1f} to {(index + 1) / LEVELS:.1f}" for index in range(LEVELS)), NEVER)


def risk_levels(risk: RiskMap) -> Iterator[Feature]:
    """For each level that there is the cells of the area, their outlines exact: risk from `from_risk` up to below
    `to_risk`, the last one inclusive, and what nobody has looked at."""
    # What is stored of a look is rounded; a share of a cell's risk so small decides nothing.
    level = np.minimum(np.floor(risk.risk * LEVELS + 1e-9).astype(int), LEVELS - 1)
    level[~risk.seen] = LEVELS
    cells = int(risk.inside.sum())
    for index, name in enumerate(NAMES):
        chosen = risk.inside & (level == index)
        count = int(chosen.sum())
        if not count:
            continue
        yield (
            _outline(chosen, risk),
            {
                "kind": "risk",
                "level": name,
                "from_risk": None if name is NEVER else index / LEVELS,
                "to_risk": None if name is NEVER else (index + 1) / LEVELS,
                "mean_risk": round(float(risk.risk[chosen].mean()), 4),
                "area_m2": round(count * risk.grid.cell_area_m2, 1),
                "share": round(count / cells, 4),
            },
        )


def _outline(chosen: BoolArray, risk: RiskMap) -> BaseGeometry:
    """What some cells cover, mission frame."""
    # Joined as runs along the rows, in whole numbers of cells: exact, and so much fewer than cells.
    steps = np.diff(np.pad(chosen, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    (rows, first), (_, after) = np.nonzero(steps == 1), np.nonzero(steps == -1)
    joined = shapely.union_all(shapely.box(first, rows, after, rows + 1)).simplify(0)
    grid = risk.grid
    # Columns are centred at whole multiples of the cell, rows begin there.
    return shapely.transform(
        joined,
        lambda places: np.column_stack(
            grid.frame.to_mission((places[:, 0] - 0.5) * grid.cell_m, places[:, 1] * grid.cell_m)
        ),
    )


def qgis_style() -> bytes:
    """A style file of QGIS for the levels: dark blue where all is found, yellow where all is missed, grey where nobody
    has looked."""
    root = Element("qgis", version="3.28.0", styleCategories="Symbology")
    renderer = SubElement(
        root, "renderer-v2", type="categorizedSymbol", attr="level", symbollevels="0", forceraster="0"
    )
    categories, symbols = SubElement(renderer, "categories"), SubElement(renderer, "symbols")
    colours = [tuple(colour) for colour in viridis((np.arange(LEVELS) + 0.5) / LEVELS).tolist()]
    for index, (name, colour) in enumerate(zip(NAMES, (*colours, UNSEEN_COLOUR), strict=True)):
        SubElement(categories, "category", symbol=str(index), value=name, label=name, render="true", type="string")
        symbol = SubElement(symbols, "symbol", type="fill", name=str(index), alpha="0.8", clip_to_extent="1")
        layer = SubElement(symbol, "layer", {"class": "SimpleFill"}, enabled="1", locked="0", **{"pass": "0"})
        options = SubElement(layer, "Option", type="Map")
        red, green, blue = colour
        for key, value in {"color": f"{red},{green},{blue},255", "outline_style": "no", "style": "solid"}.items():
            SubElement(options, "Option", type="QString", name=key, value=value)
    SubElement(root, "layerGeometryType").text = "2"
    ElementTree.indent(root)
    doctype = b"<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
    written: bytes = ElementTree.tostring(root, encoding="utf-8")
    return doctype + written + b"\n"

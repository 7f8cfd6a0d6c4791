"""SVG, element by element: well-formed and escaped by construction."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree

from markupsafe import Markup

Element = ElementTree.Element
Value = str | float


def element(tag: str, *children: Element | str, **attributes: Value) -> Element:
    """An element. Numbers are written to a tenth; of names `_` becomes `-`, and one at the end is left out."""
    made = ElementTree.Element(tag, {_name(name): _written(value) for name, value in attributes.items()})
    for child in children:
        if isinstance(child, str):
            made.text = (made.text or "") + child
        else:
            made.append(child)
    return made


def drawing(width: float, height: float, label: str, children: Iterable[Element], **attributes: Value) -> Element:
    """A whole picture; `label` says what it shows to whom does not see it."""
    box = f"0 0 {_written(width)} {_written(height)}"
    return element("svg", *children, viewBox=box, role="img", aria_label=label, **attributes)


def points(places: Iterable[tuple[float, float]]) -> str:
    """The `points` of a line or polygon."""
    return " ".join(f"{_written(x)},{_written(y)}" for x, y in places)


def markup(drawn: Element) -> Markup:
    """The element as it stands in a page."""
    return Markup(ElementTree.tostring(drawn, encoding="unicode"))


def _name(name: str) -> str:
    return name if name == "viewBox" else name.removesuffix("_").replace("_", "-")


def _written(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:.1f}".removesuffix(".0")

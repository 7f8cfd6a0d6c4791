"""Messages of every type made from the kinds their fields are annotated with: any that is valid."""

from __future__ import annotations

import enum
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
from hypothesis import strategies as st

from comms.said.wire import AtMost, Flag, Mask, Packed, Scaled, Whole, Words

MOST_DRAWN = 6  # entries of a tuple and elements along an axis: enough to differ, and quick to draw


def any_message(message_type: type[Any]) -> st.SearchStrategy[Any]:
    """Valid messages of a type, each field anywhere in its range."""
    hints = get_type_hints(message_type, include_extras=True)
    return st.builds(message_type, **{one.name: _any(hints[one.name]) for one in fields(message_type)})


def kind_of(hint: Any) -> Any:
    """The wire kind a field is annotated with; None for an enumeration, a record or a tuple of a bounded length."""
    if get_origin(hint) is not Annotated:
        return None
    return next((note for note in get_args(hint)[1:] if not isinstance(note, AtMost)), None)


def bounded_tuple(hint: Any) -> tuple[Any, int]:
    """What a tuple of a bounded length holds, and how many at most."""
    base, bound = get_args(hint)
    return get_args(base)[0], bound.count


def _any(hint: Any) -> st.SearchStrategy[Any]:
    match kind_of(hint):
        case Scaled(low=low, high=high):
            return st.floats(low, high)
        case Whole(low=low, high=high):
            return st.integers(low, high)
        case Flag():
            return st.booleans()
        case Words(longest=longest, pattern=None):
            return st.text(max_size=longest).filter(lambda text: len(text.encode()) <= longest)
        case Words(longest=longest, pattern=pattern):
            assert pattern is not None
            return st.from_regex(pattern, fullmatch=True).filter(lambda text: len(text) <= longest)
        case Packed() as packed:
            return _arrays(packed.dimensions, packed.dtype, packed.steps_per_unit, packed.high)
        case Mask():
            return _arrays(2, "?", None, 0.0)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return st.sampled_from(hint)
    if is_dataclass(hint):
        return any_message(hint)  # type: ignore[arg-type]
    entry, most = bounded_tuple(hint)
    return st.lists(_any(entry), max_size=min(most, MOST_DRAWN)).map(tuple)


@st.composite
def _arrays(draw: st.DrawFn, dimensions: int, dtype: str, steps_per_unit: int | None, high: float) -> Any:
    shape = draw(st.lists(st.integers(0, MOST_DRAWN), min_size=dimensions, max_size=dimensions))
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if steps_per_unit is None:
        top = 2 if dtype == "?" else np.iinfo(dtype).max + 1
        return generator.integers(0, top, shape).astype(dtype)
    return generator.choice([0.0, high, *generator.uniform(0.0, high, 4)], shape)

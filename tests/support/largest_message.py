"""The largest message of a type, and headers of any kind."""

from __future__ import annotations

import enum
from dataclasses import fields, is_dataclass
from typing import Any, get_args, get_type_hints

import numpy as np
from hypothesis import strategies as st

from comms.said.codec import LARGEST_INCARNATION, LARGEST_SEQUENCE, Header
from comms.said.messages import Message
from comms.said.wire import IDENTIFIER, LARGEST_MS, Flag, Mask, Octets, Packed, Scaled, Whole, Words
from secondlook.testing.checks.any_mail import bounded_tuple, kind_of

MESSAGE_TYPES: tuple[type[Any], ...] = get_args(Message)

headers = st.builds(
    Header,
    st.from_regex(IDENTIFIER, fullmatch=True),
    st.integers(0, LARGEST_INCARNATION),
    st.integers(0, LARGEST_SEQUENCE),
    st.integers(0, LARGEST_MS),
)


def largest_message(message_type: type[Any], *, tile_cells: int) -> Any:
    """A message of a type that takes the most bytes its fields allow; a coverage tile has `tile_cells` a side."""
    hints = get_type_hints(message_type, include_extras=True)
    return message_type(**{one.name: _largest(hints[one.name], tile_cells) for one in fields(message_type)})


def _largest(hint: Any, tile_cells: int) -> Any:
    match kind_of(hint):
        case Scaled(low=low, high=high):
            return max(low, high, key=abs)
        case Whole(high=high):
            return high
        case Flag():
            return True
        case Words(longest=longest):
            return "a" * longest
        case Octets(longest=longest):
            return b"a" * longest
        case Packed(dimensions=2, dtype=dtype):
            return np.full((tile_cells, tile_cells), np.iinfo(dtype).max, dtype)
        case Packed() as packed:
            return np.full((1,) * (packed.dimensions - 1) + (packed.most,), packed.high)
        case Mask():
            return np.full((tile_cells, tile_cells), True)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return list(hint)[-1]
    if is_dataclass(hint):
        return largest_message(hint, tile_cells=tile_cells)  # type: ignore[arg-type]
    entry, most = bounded_tuple(hint)
    return (_largest(entry, tile_cells),) * most

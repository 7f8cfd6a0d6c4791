"""Patterns that choose messages by their keys, as Zenoh's key expressions do."""

from __future__ import annotations

import re
from collections.abc import Callable


def key_matcher(pattern: str) -> Callable[[str], bool]:
    """Whether a whole key fits: `*` stands for one chunk or a part of it, `**` for any number of chunks, also none."""
    # Chunk by chunk, each with the `/` before it, so that `**` may stand for nothing.
    chunks = [
        "(?:/[^/]+)*" if chunk == "**" else "/" + "[^/]*".join(map(re.escape, chunk.split("*")))
        for chunk in pattern.split("/")
    ]
    expression = re.compile("".join(chunks))
    return lambda key: expression.fullmatch(f"/{key}") is not None

"""A message of a recorded mission."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from comms.said.messages import Message
from comms.said.topics import number_of

M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class Said(Generic[M]):
    """One message: its `key` below the run id, the `vehicle` that names ("" for none), who sent it and when."""

    key: str
    vehicle: str
    sender: str
    t_s: float
    message: M

    @property
    def number(self) -> int:
        """The number that the key ends in, of topics whose keys do."""
        return number_of(self.key)

"""What has arrived of a vehicle's tiles and hotspots, and whether that is all of which its state tells."""

from __future__ import annotations

from comms.said.messages import AgentState
from comms.said.tally import tally


class Arrivals:
    """Notes what comes, of a vehicle's newest start alone: of one that is no more nothing can be asked."""

    def __init__(self) -> None:
        self._incarnation = 0
        self._tiles = _Newest()
        self._hotspots = _Newest()

    def note_tile(self, incarnation: int, key: str, version: int) -> None:
        """A tile has come, also one that fits no map."""
        if self._is_of_newest(incarnation):
            self._tiles.note(key, version)

    def note_hotspot(self, incarnation: int, key: str, revision: int) -> None:
        """A hotspot's word has come."""
        if self._is_of_newest(incarnation):
            self._hotspots.note(key, revision)

    def lack(self, incarnation: int, state: AgentState) -> bool:
        """Whether something is missing of what the vehicle had said when it sent a state."""
        if incarnation < self._incarnation:
            return False
        here = incarnation == self._incarnation
        return any(
            told not in (0, tally([come.sum] if here else ()))
            for told, come in ((state.tiles_told, self._tiles), (state.hotspots_told, self._hotspots))
        )

    def _is_of_newest(self, incarnation: int) -> bool:
        if incarnation > self._incarnation:
            self._incarnation = incarnation
            self._tiles, self._hotspots = _Newest(), _Newest()
        return incarnation == self._incarnation


class _Newest:
    """The newest version of each thing that has come, and their sum."""

    def __init__(self) -> None:
        self.sum = 0
        self._versions: dict[str, int] = {}

    def note(self, key: str, version: int) -> None:
        before = self._versions.get(key, 0)
        if version > before:
            self._versions[key] = version
            self.sum += version - before

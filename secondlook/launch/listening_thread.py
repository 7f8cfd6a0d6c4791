"""A listener in a thread of the launcher's own process."""

from __future__ import annotations

import threading
from typing import Any

from comms.control import RunKeys
from comms.lockstep.host import ListenerHost
from comms.node import Listener
from comms.said.routing import Routing
from comms.session import open_client
from comms.wall.host import WallHost
from comms.wall.seats import ListenerSeat
from comms.wall.words import WallKeys
from secondlook.fleet.build import Fleet
from secondlook.recorded.observer import RunStopped


class ListeningThread:
    """Listens at the hub, under a node's id as host and user name, from `start` to the run's end or to `stop`.

    Whatever happens, the listener is closed by then. `error` is what went wrong; `stopped`: the listener has raised
    RunStopped.
    """

    def __init__(
        self,
        node_id: str,
        listener: Listener,
        keys: RunKeys,
        routing: Routing,
        password: str,
        patience_s: float,
        fleet: Fleet,
    ) -> None:
        self.error: Exception | None = None
        self.stopped = False
        self._node_id = node_id
        self._listener = listener
        self._keys = keys
        self._routing = routing
        self._password = password
        self._patience_s = patience_s
        self._fleet = fleet
        self._host: ListenerHost | WallHost | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._listen, name=node_id, daemon=True)
        self._endpoint = ""

    def start(self, endpoint: str) -> None:
        """Connects and begins to listen."""
        self._endpoint = endpoint
        self._thread.start()

    def join(self, timeout_s: float) -> None:
        """Waits for its end after the run's."""
        self._thread.join(timeout_s)

    def interrupt(self) -> None:
        """Lets it end early, if it has not ended yet."""
        self._stopping.set()
        if self._host is not None:
            self._host.interrupt()

    def stop(self, timeout_s: float) -> None:
        """Interrupts it and waits for its end."""
        self.interrupt()
        if self._thread.is_alive():
            self._thread.join(timeout_s)
        if self._host is None:  # it never came to listen
            try:
                self._listener.close()
            except Exception as error:
                self.error = self.error or error

    def _listen(self) -> None:
        try:
            with open_client(self._endpoint, self._node_id, self._password, patience_s=self._patience_s) as session:
                self._host = self._make_host(session)
                if self._stopping.is_set():
                    self._host.interrupt()
                try:
                    self._host.run()
                except RunStopped:
                    self.stopped = True
        except Exception as error:
            self.error = error

    def _make_host(self, session: Any) -> ListenerHost | WallHost:
        if self._fleet.factor is None:
            return ListenerHost(session, self._keys, self._node_id, self._node_id, self._listener, self._routing)
        seat = ListenerSeat({self._node_id: self._listener}, self._routing)
        sha256, limit_ms = self._fleet.run_info.scenario_sha256, self._fleet.time_limit_ms
        return WallHost(session, WallKeys(self._keys.run), self._node_id, seat, self._routing, sha256, limit_ms)

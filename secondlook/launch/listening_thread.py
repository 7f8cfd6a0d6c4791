"""A listener in a thread of the launcher's own process."""

from __future__ import annotations

import threading

from comms.drive import Drive, ListeningHost, Setup
from comms.node import Listener
from comms.session import open_client
from secondlook.recorded.observer import RunStopped


class ListeningThread:
    """Listens at the hub, under a node's id as host and user name, from `start` to the run's end or to `stop`.

    Whatever happens, the listener is closed by then. `error` is what went wrong; `stopped`: the listener has raised
    RunStopped.
    """

    def __init__(self, node_id: str, listener: Listener, setup: Setup, drive: Drive, password: str) -> None:
        self.error: Exception | None = None
        self.stopped = False
        self._node_id = node_id
        self._listener = listener
        self._setup = setup
        self._drive = drive
        self._password = password
        self._host: ListeningHost | None = None
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
        name, setup = self._node_id, self._setup
        try:
            with open_client(self._endpoint, name, self._password, patience_s=setup.patience_s) as session:
                self._host = self._drive.listening(session, setup, name, name, self._listener)
                if self._stopping.is_set():
                    self._host.interrupt()
                try:
                    self._host.run()
                except RunStopped:
                    self.stopped = True
        except Exception as error:
            self.error = error

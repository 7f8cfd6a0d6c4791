"""Keeps a listener to the rules of the house: what it raises is told as a node's failure."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from comms.node import Listener, Received
from comms.runner import NodeError, failure_of


class KeptListener:
    """A listener (`comms.node.Listener`) under its node's id; raises NodeError."""

    def __init__(self, node_id: str, listener: Listener) -> None:
        self._node_id = node_id
        self._listener = listener

    def on_message(self, received: Received) -> None:
        """Passes one message on."""
        try:
            self._listener.on_message(received)
        except Exception as error:
            raise failure_of(self._node_id, error, at_ms=received.header.sent_ms) from error

    def close(self) -> None:
        """Closes the listener."""
        try:
            self._listener.close()
        except Exception as error:
            raise failure_of(self._node_id, error) from error


def close_all(listeners: Iterable[KeptListener]) -> None:
    """Closes each, also when another fails to close; then raises the first NodeError, but never in place of an error
    that is on its way already."""
    failures = []
    for listener in listeners:
        try:
            listener.close()
        except NodeError as failure:
            failures.append(failure)
    if failures and sys.exception() is None:
        raise failures[0]

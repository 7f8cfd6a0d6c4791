"""Hosts that are network namespaces of this machine, each with an address of its own, around a hub (Linux, root)."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

NETWORK = "10.91.7"


class Namespaces:
    """A hub's namespace with a bridge, and one for each host, linked to that by a pair of virtual interfaces."""

    def __init__(self, hosts: Sequence[str]) -> None:
        self._prefix = f"sl{os.getpid()}"
        self._names = {host: f"{self._prefix}-{host}" for host in ("hub", *hosts)}
        self._links = {host: f"to-{host}" for host in hosts}
        self.address = f"{NETWORK}.1"

    def make(self) -> None:
        """Makes all of it."""
        for name in self._names.values():
            _ip("netns", "add", name)
            _ip("-n", name, "link", "set", "lo", "up")
        hub = self._names["hub"]
        _ip("-n", hub, "link", "add", "bridge", "type", "bridge")
        _ip("-n", hub, "addr", "add", f"{self.address}/24", "dev", "bridge")
        _ip("-n", hub, "link", "set", "bridge", "up")
        for number, (host, link) in enumerate(self._links.items(), start=2):
            name = self._names[host]
            _ip("-n", hub, "link", "add", link, "type", "veth", "peer", "name", "uplink", "netns", name)
            _ip("-n", hub, "link", "set", link, "master", "bridge", "up")
            _ip("-n", name, "addr", "add", f"{NETWORK}.{number}/24", "dev", "uplink")
            _ip("-n", name, "link", "set", "uplink", "up")

    def remove(self) -> None:
        """Takes all of it away again."""
        for name in self._names.values():
            subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)

    def within(self, host: str) -> list[str]:
        """What a command line begins with that is to run there."""
        return ["ip", "netns", "exec", self._names[host]]

    def cut_off(self, host: str) -> None:
        """Takes the host's link down."""
        _ip("-n", self._names["hub"], "link", "set", self._links[host], "down")

    def join(self, host: str) -> None:
        """Puts it up again."""
        _ip("-n", self._names["hub"], "link", "set", self._links[host], "up")


@contextmanager
def namespaces(*hosts: str) -> Iterator[Namespaces]:
    """Namespaces that are gone afterwards."""
    made = Namespaces(hosts)
    try:
        made.make()
        yield made
    finally:
        made.remove()


def _ip(*arguments: str) -> None:
    done = subprocess.run(["ip", *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"ip {' '.join(arguments)}: {done.stderr}"

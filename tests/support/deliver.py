"""Gives one node that is driven by hand any mail."""

from __future__ import annotations

from collections.abc import Sequence

from one_node import OneNode

from comms.said.messages import Maneuver
from secondlook.testing.checks.any_mail import Letter, about_last


def deliver(node: OneNode, mail: Sequence[Letter]) -> None:
    """Gives the node its mail; `OneNode` holds what it says and when it wants to be woken to the rules."""
    for letter in mail:
        commanded = node.all(Maneuver)
        node.hear(
            letter.key,
            about_last(letter.message, commanded[-1] if commanded else None),
            at_ms=node.now_ms + letter.after_ms if letter.after_ms else None,
            sequence=letter.sequence,
            incarnation=letter.incarnation,
        )
    node.wait(100)

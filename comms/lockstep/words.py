"""Words between clock and processes in lockstep.

A process is a host: it holds some of the nodes, or one listener. Hub to host: `welcome`, `kept`, `grant`, `mark`,
`last_word`, `finish`, `goodbye`. Host to hub: `hello`, `ready`, `answer`, `ack`, `done`, `failed`.
"""

from __future__ import annotations

from typing import Any

from comms.errors import WordsError
from comms.lockstep.clock import Grant, Sent
from comms.words import pack, types_of


def pack_grants(now_ms: int, grants: list[Grant]) -> bytes:
    """Leave for a host's nodes to act."""
    return pack("grant", now_ms, [[one.node_id, one.wake, one.expected, one.start] for one in grants])


def unpack_grants(words: list[Any]) -> tuple[int, list[Grant]]:
    """Time and grants of a `grant`."""
    _, now_ms, grants = words
    return now_ms, [Grant(*one) for one in grants]


def pack_answers(answers: list[tuple[str, int | None, list[Sent]]]) -> bytes:
    """For each granted node its next wake-up and what it has published."""
    return pack("answer", [[node, wake, [[one.key, one.size] for one in sent]] for node, wake, sent in answers])


def unpack_answers(words: list[Any]) -> list[tuple[str, int | None, list[Sent]]]:
    """The answers of an `answer`; raises WordsError."""
    match words:
        case ["answer", list(answers)]:
            if all(types_of(one) in ([str, int, list], [str, type(None), list]) for one in answers) and all(
                types_of(sent) == [str, int] and sent[1] >= 0 for one in answers for sent in one[2]
            ):
                return [(node, wake, [Sent(*sent) for sent in all_sent]) for node, wake, all_sent in answers]
    raise WordsError("an answer that is none")

"""A hub by the wall clock that is started anew: what it hears before it knows what time it is."""

from __future__ import annotations

import contextlib
import queue
import threading

from by_wall import FACTOR, ROUTING, WALL_KEYS, WALL_RUN
from fleets import EACH_ALONE, Scripted

from comms.errors import Interrupted
from comms.result import Ending
from comms.said.codec import SCHEMA_VERSION, Header, encode
from comms.said.messages import MissionOver
from comms.said.topics import MISSION_OVER
from comms.session import open_client, open_hub, put, subscribe
from comms.wall.hub import WallHub
from comms.wall.seats import NodeSeat
from comms.wall.words import Hello, pack_hello, unpack_finish
from comms.words import unpack

SOON_S = 10.0
LIMIT_MS = 600_000
OVER_MS, NOW_MS = 400_000, 410_000


def test_that_the_mission_is_over_waits_until_the_time_is_known() -> None:
    heard: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
    session, endpoint = open_hub({"coordinator": "secret"}, None)
    with session, open_client(endpoint, "coordinator", "secret") as own:
        seat = NodeSeat({"world": Scripted()}, ROUTING)
        hub = WallHub(session, WALL_KEYS, ROUTING, EACH_ALONE, seat, WALL_RUN, LIMIT_MS, FACTOR, strict=False)
        subscribers = subscribe(own, [WALL_KEYS.to_host("coordinator"), WALL_KEYS.time], lambda *one: heard.put(one))

        def run() -> None:
            with contextlib.suppress(Interrupted):
                hub.run()

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        try:
            while unpack(heard.get(timeout=SOON_S)[1])[0] != "time":  # it runs, and does not know the time
                pass
            over = encode(Header("coordinator", 0, 7, OVER_MS), MissionOver(""))
            put(own, WALL_KEYS.topic(MISSION_OVER.key()), over)
            for _ in range(2):  # it has heard that, and looked what is due
                heard.get(timeout=SOON_S)
            hello = Hello("1", SCHEMA_VERSION, WALL_RUN.scenario_sha256, True, NOW_MS)
            put(own, WALL_KEYS.from_host("coordinator"), pack_hello(hello))
            words = ["time"]
            while words[0] != "finish":  # at its time limit it ends anyway
                words = unpack(heard.get(timeout=SOON_S)[1])
            result = unpack_finish(words)
            assert (result.ending, result.mission_ms) == (Ending.OVER, OVER_MS)
        finally:
            hub.interrupt()
            thread.join(SOON_S)
        assert not thread.is_alive()
        del subscribers

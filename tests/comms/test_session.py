"""Sessions: whoever is of the fleet gets in, however many strangers stand at the door."""

from __future__ import annotations

import socket
from contextlib import ExitStack

from comms.session import open_client, open_hub


def test_150_connections_that_say_nothing_keep_nobody_out() -> None:
    session, endpoint = open_hub({"beta": "secret"}, None)
    host, port = endpoint.removeprefix("tcp/").split(":")
    with session, ExitStack() as strangers:
        for _ in range(150):
            strangers.enter_context(socket.create_connection((host, int(port))))
        with open_client(
            endpoint, "beta", "secret", connect_timeout_s=2.0
        ) as beta:  # sooner than strangers are sent off
            assert beta.info.routers_zid() == [session.info.zid()]

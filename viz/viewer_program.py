"""The viewer's own program, the way it is started here: quiet, and where it says that it listens."""

from __future__ import annotations

import os
import re
from pathlib import Path

import rerun_cli  # type: ignore[import-untyped]

# The wheel's command is a wrapper that leaves the viewer behind when it is killed: start the viewer itself.
PROGRAM = str(Path(rerun_cli.__file__).with_name("rerun"))
# On this machine only, where the default is every network; the system picks the port.
BIND = ("--bind", "127.0.0.1", "--port", "0")
LISTENING = re.compile(r"Listening for gRPC connections on (127\.0\.0\.1:\d+)")


def quiet_environment() -> dict[str, str]:
    """This process's environment, changed so that the viewer sends no usage statistics and looks for no update."""
    # CI is the viewer's switch for usage statistics that needs no file in anyone's home.
    environment = {**os.environ, "CI": "1", "NO_COLOR": "1"}
    environment.pop("RUST_LOG", None)  # it would hide what the viewer says of its ports
    # The viewer would ask a host outside for a newer version of itself: a proxy that is not there keeps it from that.
    return environment | dict.fromkeys(("HTTPS_PROXY", "https_proxy"), "http://127.0.0.1:1")

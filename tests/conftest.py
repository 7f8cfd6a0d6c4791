"""What holds for the tests of every room."""

from __future__ import annotations

import signal

from hypothesis import settings

# Whoever starts the tests in the background may have made them deaf to Ctrl-C, and what they start with them.
signal.signal(signal.SIGINT, signal.default_int_handler)

# How long one example takes says more about the machine than about the code.
settings.register_profile("secondlook", deadline=None)
settings.load_profile("secondlook")

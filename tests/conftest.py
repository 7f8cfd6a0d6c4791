"""What holds for the tests of every room."""

from __future__ import annotations

from hypothesis import settings

# How long one example takes says more about the machine than about the code.
settings.register_profile("secondlook", deadline=None)
settings.load_profile("secondlook")

"""The packages that only the comparison with the paper needs."""

from __future__ import annotations

from importlib.util import find_spec

from secondlook.errors import UserError

NEEDED = {"sklearn": "scikit-learn", "matplotlib": "matplotlib"}
"""What is imported, and what it is called where packages are installed from."""


def require_extra() -> None:
    """Raises UserError, in one sentence, where a package of the extra `paper` is not installed."""
    missing = [name for module, name in NEEDED.items() if find_spec(module) is None]
    if missing:
        names = " and ".join(missing)
        raise UserError(
            f"secondlook paper needs {names}, not installed here; the extra secondlook[paper] has all of it"
        )

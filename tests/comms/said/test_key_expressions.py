"""Key expressions stand for the keys that they stand for in Zenoh; what stands for none is refused."""

from __future__ import annotations

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from comms.said.key_expressions import KeyExpression, key_expression

CHUNKS = ["a", "b", "ab", "ba", "aab", "a-0", "7"]
KEYS = st.lists(st.sampled_from(CHUNKS), min_size=1, max_size=5).map("/".join)
NAMES = st.lists(st.sampled_from(["a", "b", "-0", "7"]), min_size=1, max_size=3).map("$*".join)
STARS = st.sampled_from(["*", "**", "$*a", "a$*", "$*b$*", "$*a$*b"])
EXPRESSIONS = st.lists(st.one_of(st.sampled_from(CHUNKS), NAMES, STARS), min_size=1, max_size=5).map("/".join)


def in_zenoh(text: str) -> zenoh.KeyExpr:
    """The same expression written as Zenoh wants it: of `**` and what follows, each star in its one place."""
    chunks: list[str] = []
    for chunk in text.split("/"):
        if chunks[-1:] == ["**"] and chunk == "**":
            continue
        chunks.insert(len(chunks) - (chunks[-1:] == ["**"] and chunk == "*"), chunk)
    return zenoh.KeyExpr("/".join(chunks))


@given(EXPRESSIONS, KEYS)
def test_an_expression_stands_for_the_keys_that_it_stands_for_in_zenoh(text: str, key: str) -> None:
    assert KeyExpression(text).includes(key) == in_zenoh(text).includes(zenoh.KeyExpr(key))


@given(EXPRESSIONS, st.lists(st.sampled_from([*CHUNKS, "*"]), min_size=1, max_size=5).map("/".join))
def test_where_a_vehicle_is_not_known_it_may_be_any(text: str, keys: str) -> None:
    assert KeyExpression(text).includes(keys) == in_zenoh(text).intersects(zenoh.KeyExpr(keys))


@given(st.text("ab*$/#?", max_size=7))
def test_what_is_no_expression_in_zenoh_is_none(text: str) -> None:
    def allows(make: object) -> bool:
        try:
            make(text)  # type: ignore[operator]
        except (ValueError, zenoh.ZError):
            return False
        return True

    assert allows(KeyExpression) == allows(in_zenoh)


@pytest.mark.parametrize(
    "text", ["", "coord//strip", "/run", "run/", "***", "agent/***", "?", "#", "$", "a$", "a*", "$*"]
)
def test_the_refusal_is_one_sentence(text: str) -> None:
    with pytest.raises(ValueError, match=r"is no key expression; must be chunks between single /, ") as refused:
        key_expression(text)
    assert str(refused.value).startswith(repr(text))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("pattern", "fits", "fits_not"),
    [
        ("**", ["run", "agent/a/state"], []),
        ("agent/*/state", ["agent/a/state", "agent/b-2/state"], ["agent/state", "agent/a/b/state", "agent/a/states"]),
        ("agent/**", ["agent", "agent/a", "agent/a/b"], ["agents/a", "x/agent"]),
        ("**/state", ["state", "a/b/state"], ["a/states", "a/state/b"]),
        ("agent/**/9", ["agent/9", "agent/a/9", "agent/a/b/9"], ["agent/99", "agent/a/19"]),
        ("agent/$*-0/plan", ["agent/a-0/plan", "agent/-0/plan"], ["agent/a-1/plan", "agent/a/-0/plan"]),
        ("a.b", ["a.b"], ["axb", ""]),
    ],
)
def test_expressions_choose_by_chunks(pattern: str, fits: list[str], fits_not: list[str]) -> None:
    expression = KeyExpression(pattern)
    assert [key for key in fits + fits_not if expression.includes(key)] == fits


FLEET = ("primary", "helper")
SOME = ["**", "*", "run", "agent/**", "agent/*/coverage/*", "**/hotspot/1$*", "veh/*/na$*", "agent/*/coverage/3-0"]
NONE = [
    "agnt/**",
    "agent/*",
    "agent/*/coverge/*",
    "agent/*/hotspot",
    "coord/strip/one",
    "veh/*/look/*",
    "coord/*/*/*/*",
]


@pytest.mark.parametrize("text", [*SOME, "agent/helper/task_status/7"])
def test_what_a_key_can_be_like(text: str) -> None:
    for vehicles in (FLEET, ()):
        assert isinstance(key_expression(text, vehicles), KeyExpression)


@pytest.mark.parametrize("text", NONE)
def test_what_none_can_be_like(text: str) -> None:
    with pytest.raises(
        ValueError, match=r"^no key is like '.*'; there are run, veh/.*, world/truth/pose/[*], and the vehicl"
    ):
        key_expression(text, FLEET)
    with pytest.raises(ValueError, match=r"^no key is like '.*'; there are run, veh/.*, world/truth/pose/[*]$"):
        key_expression(text)


def test_vehicles_count_where_they_are_known() -> None:
    assert key_expression("agent/other/*").includes("agent/other/state")
    with pytest.raises(ValueError, match=r"^no key is like 'agent/other/[*]'; .* and the vehicles primary, helper$"):
        key_expression("agent/other/*", FLEET)

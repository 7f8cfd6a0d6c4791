"""How one value travels: quantities as scaled integers, arrays as packed bytes, records as positional arrays.

A message is a frozen dataclass whose fields are annotated with a kind from this file. A receiver gets the quantised
value, on every bus, so that everyone decides on the same numbers. Whatever does not fit raises `WireError`.
"""

from __future__ import annotations

import enum
import operator
import re
import reprlib
from collections.abc import Callable, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cached_property, lru_cache
from typing import Annotated, Any, NamedTuple, Protocol, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

IDENTIFIER = re.compile(r"[a-z0-9_-]{1,40}")
LARGEST_MS = 2**53  # of any time; a float still holds it exactly


class WireError(ValueError):
    """A value that does not fit its field; the text says what and what is allowed."""


# What a value of the wrong type or size raises in a conversion; WireError is a ValueError.
MISFITS = (ValueError, TypeError, ArithmeticError, AttributeError)

# Says in few words what has arrived, however long or deeply nested it is.
_BRIEFLY = reprlib.Repr()
_BRIEFLY.maxlevel = 2
_BRIEFLY.maxlist = _BRIEFLY.maxdict = 4
_BRIEFLY.maxstring = _BRIEFLY.maxother = 60


class Kind(Protocol):
    """How one field's value becomes a MessagePack value and back.

    A kind of which there are many may have both written out as expressions too, see `Quick`. One that is slow to decode
    may have a method `again`, which decodes what `encode` has just made, and so need not be looked at.
    """

    def encode(self, value: Any) -> Any:
        """The wire form; raises WireError where the value is outside the field's range."""

    def decode(self, wire: Any) -> Any:
        """The value; raises WireError where the wire form is not one this field can have."""


class Quick(NamedTuple):
    """A kind's conversions as Python expressions, which a record's codec is put together from: most of the time would
    go into calls, one for each field. `{got}` stands for what is converted and is to be evaluated once, `{slow}` for
    the kind's own method, to which an expression leaves all that is not plain, and to say no. `again`: see `Kind`."""

    encode: str
    decode: str
    again: str


@dataclass(frozen=True)
class Scaled:
    """A real number as an integer count of steps: `steps_per_unit` steps to one unit, from `low` to `high` units."""

    unit: str
    steps_per_unit: int
    low: float
    high: float

    def encode(self, value: float) -> int:
        if not self.low <= value <= self.high:  # refuses NaN too
            raise WireError(f"{value} {self.unit} is outside {self.low} to {self.high}")
        return round(value * self.steps_per_unit)

    def decode(self, wire: Any) -> float:
        if type(wire) is not int or not self.low <= wire / self.steps_per_unit <= self.high:
            raise WireError(
                f"{_BRIEFLY.repr(wire)} is not a whole number of steps in {self.low} to {self.high} {self.unit}"
            )
        return wire / self.steps_per_unit

    @property
    def quick(self) -> Quick:
        low, high, steps = self.low, self.high, self.steps_per_unit
        return Quick(
            f"(v * {steps}).__round__() if {low!r} <= (v := {{got}}) <= {high!r} else {{slow}}(v)",
            f"w if type(v := {{got}}) is int and {low!r} <= (w := v / {steps}) <= {high!r} else {{slow}}(v)",
            f"{{got}} / {steps}",
        )


@dataclass(frozen=True)
class Whole:
    """A whole number from `low` to `high`."""

    low: int
    high: int

    def encode(self, value: int) -> int:
        number = int(operator.index(value))  # index refuses 2.5, which int alone would cut off
        if not self.low <= number <= self.high:
            raise WireError(f"{number} is outside {self.low} to {self.high}")
        return number

    def decode(self, wire: Any) -> int:
        if type(wire) is not int or not self.low <= wire <= self.high:
            raise WireError(f"{_BRIEFLY.repr(wire)} is not a whole number from {self.low} to {self.high}")
        return wire

    @property
    def quick(self) -> Quick:
        plain = f"v if type(v := {{got}}) is int and {self.low} <= v <= {self.high} else {{slow}}(v)"
        return Quick(plain, plain, "{got}")


@dataclass(frozen=True)
class Flag:
    """True or false."""

    def encode(self, value: bool) -> bool:
        if not isinstance(value, bool | np.bool_):
            raise WireError(f"{_BRIEFLY.repr(value)} is not true or false")
        return bool(value)

    def decode(self, wire: Any) -> bool:
        if type(wire) is not bool:
            raise WireError(f"{_BRIEFLY.repr(wire)} is not true or false")
        return wire

    @property
    def quick(self) -> Quick:
        plain = "v if type(v := {got}) is bool else {slow}(v)"
        return Quick(plain, plain, "{got}")


@dataclass(frozen=True)
class Words:
    """Text of at most `longest` bytes in UTF-8; `pattern` narrows it."""

    longest: int
    pattern: re.Pattern[str] | None = None

    def encode(self, value: str) -> str:
        return self.decode(value)

    def decode(self, wire: Any) -> str:
        try:
            fits = type(wire) is str and len(wire.encode()) <= self.longest
        except UnicodeEncodeError:  # half a surrogate pair
            fits = False
        if not fits:
            raise WireError(f"{_BRIEFLY.repr(wire)} is not text of at most {self.longest} bytes")
        text: str = wire
        if self.pattern is not None and not self.pattern.fullmatch(text):
            raise WireError(f"{_BRIEFLY.repr(text)} does not match {self.pattern.pattern}")
        return text

    def again(self, wire: str) -> str:
        return wire


@dataclass(frozen=True)
class Octets:
    """At most `longest` bytes."""

    longest: int

    def encode(self, value: bytes) -> bytes:
        return self.decode(value)

    def decode(self, wire: Any) -> bytes:
        if type(wire) is not bytes or len(wire) > self.longest:
            raise WireError(f"not at most {self.longest} bytes")
        return wire


@dataclass(frozen=True)
class Choice:
    """One member of an enumeration, by its place in it."""

    members: tuple[enum.Enum, ...]

    def encode(self, value: enum.Enum) -> int:
        return self.members.index(value)  # ValueError, as any misfit, where it is no member

    def decode(self, wire: Any) -> enum.Enum:
        if type(wire) is not int or not 0 <= wire < len(self.members):
            raise WireError(f"{_BRIEFLY.repr(wire)} is not one of 0 to {len(self.members) - 1}")
        return self.members[wire]


@dataclass(frozen=True)
class Packed:
    """An array with `dimensions` axes of at most `most` elements, as its shape and its bytes.

    `steps_per_unit`: None keeps the integers of `dtype` as they are; a number scales floats in [0, `high`] to them.
    """

    dimensions: int
    dtype: str
    most: int
    steps_per_unit: int | None = None
    high: float = 0.0

    def encode(self, value: NDArray[Any]) -> list[Any]:
        array = np.asarray(value)
        if array.ndim != self.dimensions or array.size > self.most:
            raise WireError(f"an array of shape {array.shape} has not {self.dimensions} axes and {self.most} elements")
        if self.steps_per_unit is not None:
            if array.size and not (float(array.min()) >= 0.0 and float(array.max()) <= self.high):  # refuses NaN too
                raise WireError(f"an array's values are outside 0 to {self.high}")
            array = np.rint(array * self.steps_per_unit).astype(self._dtype)
        elif array.dtype != self._dtype:
            if not np.can_cast(array.dtype, self._dtype):
                raise WireError(f"an array of {array.dtype} does not go into {self._dtype} without loss")
            array = array.astype(self._dtype)
        return [*array.shape, array.tobytes()]

    def decode(self, wire: Any) -> NDArray[Any]:
        if type(wire) is not list or len(wire) != self.dimensions + 1 or type(wire[-1]) is not bytes:
            raise WireError(f"not an array of {self.dimensions} axes")
        *shape, packed = wire
        size = _size_of(shape, self.most)
        if size * self._dtype.itemsize != len(packed):
            raise WireError(f"{len(packed)} bytes do not fill the shape {shape}")
        values = self.again(wire)
        if size and self.steps_per_unit is not None and float(values.max()) > self.high:
            raise WireError(f"an array's values are above {self.high}")
        return values

    def again(self, wire: list[Any]) -> NDArray[Any]:
        array: NDArray[Any] = np.ndarray(wire[:-1], self._dtype, wire[-1])
        if self.steps_per_unit is None:
            return array
        values = array / self.steps_per_unit
        values.setflags(write=False)  # one message may have several readers
        return values

    @cached_property
    def _dtype(self) -> np.dtype[Any]:
        return np.dtype(self.dtype)


@dataclass(frozen=True)
class Mask:
    """A two-dimensional array of true and false, eight to a byte."""

    most: int

    def encode(self, value: NDArray[np.bool_]) -> list[Any]:
        array = np.asarray(value, dtype=np.bool_)
        if array.ndim != 2 or array.size > self.most:
            raise WireError(f"a mask of shape {array.shape} has not 2 axes and at most {self.most} cells")
        return [*array.shape, np.packbits(array).tobytes()]

    def decode(self, wire: Any) -> NDArray[np.bool_]:
        if type(wire) is not list or len(wire) != 3 or type(wire[2]) is not bytes:
            raise WireError("not a mask")
        *shape, packed = wire
        size = _size_of(shape, self.most)
        if len(packed) != (size + 7) // 8:
            raise WireError(f"{len(packed)} bytes do not fill the shape {shape}")
        return _unpacked(*shape, packed)

    def again(self, wire: list[Any]) -> NDArray[np.bool_]:
        return _unpacked(*wire)


@lru_cache(maxsize=1024)  # most masks are one of few: all true, or all false
def _unpacked(rows: int, columns: int, packed: bytes) -> NDArray[np.bool_]:
    bits = np.unpackbits(np.frombuffer(packed, dtype=np.uint8), count=rows * columns)  # each 0 or 1, as a bool is
    mask = bits.view(np.bool_).reshape(rows, columns)
    mask.setflags(write=False)
    return mask


def _size_of(shape: list[Any], most: int) -> int:
    """How many elements an array has; raises WireError where that is more than `most`, or this is no shape."""
    size = 1
    for axis in shape:
        if type(axis) is not int or not 0 <= axis <= most:
            break
        size *= axis
    else:
        if size <= most:
            return size
    raise WireError(f"{_BRIEFLY.repr(shape)} is not a shape of at most {most} elements")


@dataclass(frozen=True)
class Many:
    """At most `most` values of one kind, as a tuple."""

    kind: Kind
    most: int

    def encode(self, value: tuple[Any, ...]) -> list[Any]:
        if len(value) > self.most:
            raise WireError(f"{len(value)} entries are more than {self.most}")
        return list(value) if self._are_plain(value) else [self.kind.encode(one) for one in value]

    def decode(self, wire: Any) -> tuple[Any, ...]:
        if type(wire) is not list or len(wire) > self.most:
            raise WireError(f"not a list of at most {self.most} entries")
        return tuple(wire) if self._are_plain(wire) else tuple(self.kind.decode(one) for one in wire)

    def again(self, wire: list[Any]) -> tuple[Any, ...]:
        return tuple(wire) if type(self.kind) is Whole else tuple(map(_again_of(self.kind), wire))

    def _are_plain(self, values: Sequence[Any]) -> bool:
        """Whether these are whole numbers within bounds, which are on the wire as they are: the same, and faster."""
        kind = self.kind
        if not values or type(kind) is not Whole or {*map(type, values)} != {int}:
            return False
        return bool(kind.low <= min(values) and max(values) <= kind.high)


class Record:
    """A frozen dataclass as a positional array of its fields. The last ones may be missing if they have defaults, which
    then hold. Of a class with `LEFT_OUT` so many of the last ones are not written where all have their defaults."""

    def __init__(self, cls: type[Any]) -> None:
        hints = get_type_hints(cls, include_extras=True)
        kinds = {field.name: _kind_of(hints[field.name], f"{cls.__name__}.{field.name}") for field in fields(cls)}
        self.cls = cls
        self.fields: tuple[tuple[str, Callable[[Any], Any], Callable[[Any], Any]], ...] = tuple(
            (name, kind.encode, kind.decode) for name, kind in kinds.items()
        )
        self._defaults = [kinds[one.name].encode(one.default) for one in fields(cls) if one.default is not MISSING]
        self._encode, self._decode, self._again = _put_together(cls, kinds)
        self._left_out = getattr(cls, "LEFT_OUT", 0)

    def encode(self, value: Any) -> list[Any]:
        try:
            wire = self._encode(value)
        except MISFITS:
            wire = self._name_the_field(lambda name, encode, _: encode(getattr(value, name)))
        last = self._left_out
        return wire[:-last] if last and wire[-last:] == self._defaults[-last:] else wire

    def decode(self, wire: Any) -> Any:
        if type(wire) is not list or len(wire) != len(self.fields):
            lacks = len(self.fields) - len(wire) if type(wire) is list else -1
            if not 0 < lacks <= len(self._defaults):
                raise WireError(f"{self.cls.__name__} needs a list of {len(self.fields)} fields")
            wire = [*wire, *self._defaults[-lacks:]]
        try:
            return self._decode(*wire)
        except MISFITS:
            values = iter(wire)
            return self._name_the_field(lambda _name, _encode, decode: decode(next(values)))

    def again(self, wire: list[Any]) -> Any:
        """The value of what `encode` has just made; not looked at, which takes longer than all else."""
        return self._again(*wire) if len(wire) == len(self.fields) else self.decode(wire)

    def _name_the_field(self, convert: Callable[[str, Callable[..., Any], Callable[..., Any]], Any]) -> list[Any]:
        # The slow second pass is taken only for a value that does not fit, to say which field it was.
        for name, encode, decode in self.fields:
            try:
                convert(name, encode, decode)
            except MISFITS as error:
                raise WireError(f"{self.cls.__name__}.{name}: {error}") from None
        raise AssertionError("a conversion that failed once passed the second time")


def _put_together(
    cls: type[Any], kinds: dict[str, Kind]
) -> tuple[Callable[[Any], list[Any]], Callable[..., Any], Callable[..., Any]]:
    """Three functions: from an object of a class to the list of its fields' wire forms, from these to an object, and
    from those that the first one has just made."""
    methods: dict[str, Any] = {"cls": cls}
    to_wire, from_wire, again = [], [], []
    for name, kind in kinds.items():
        quick: Quick = getattr(kind, "quick", _SLOW)
        methods |= {f"encode_{name}": kind.encode, f"decode_{name}": kind.decode, f"again_{name}": _again_of(kind)}
        to_wire.append(quick.encode.format(got=f"record.{name}", slow=f"encode_{name}"))
        from_wire.append(quick.decode.format(got=name, slow=f"decode_{name}"))
        again.append(quick.again.format(got=name, slow=f"again_{name}"))
    encode = eval(f"lambda record: [{', '.join(to_wire)}]", methods)
    decode, once_more = (
        eval(f"lambda {', '.join(kinds)}: cls({', '.join(some)})", methods) for some in (from_wire, again)
    )
    return encode, decode, once_more


def _again_of(kind: Kind) -> Callable[[Any], Any]:
    return getattr(kind, "again", kind.decode)


_SLOW = Quick("{slow}({got})", "{slow}({got})", "{slow}({got})")
_RECORDS: dict[object, Record] = {}


def record_of(cls: type[Any]) -> Record:
    """The codec of a message class, made once."""
    try:
        return _RECORDS[cls]
    except KeyError:
        return _RECORDS.setdefault(cls, Record(cls))


def _kind_of(hint: Any, where: str) -> Kind:
    if get_origin(hint) is Annotated:
        for note in get_args(hint)[1:]:
            if hasattr(note, "encode") and hasattr(note, "decode"):
                return note  # type: ignore[no-any-return]
        most = next((note for note in get_args(hint)[1:] if isinstance(note, AtMost)), None)
        base = get_args(hint)[0]
        if most is not None and get_origin(base) is tuple:
            return Many(_kind_of(get_args(base)[0], where), most.count)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return Choice(tuple(hint))
    if isinstance(hint, type) and is_dataclass(hint):
        return record_of(hint)
    raise TypeError(f"{where}: no wire kind for {hint!r}")


@dataclass(frozen=True)
class AtMost:
    """Bounds how many entries a tuple field may have on the wire."""

    count: int


LONGEST_TEXT = 200  # bytes in UTF-8


def shortened(text: str) -> str:
    """As much of a text's beginning as fits a message's `Text`."""
    return text.encode(errors="replace")[:LONGEST_TEXT].decode(errors="ignore")


Metres = Annotated[float, Scaled("m", 100, -1e7, 1e7)]
Radians = Annotated[float, Scaled("rad", 1_000_000, -7.0, 7.0)]
RadiansPerSecond = Annotated[float, Scaled("rad/s", 1_000_000, -1e4, 1e4)]
MetresPerSecond = Annotated[float, Scaled("m/s", 1000, 0.0, 100.0)]
Probability = Annotated[float, Scaled("(probability)", 10_000, 0.0, 1.0)]
SquareMetres = Annotated[float, Scaled("m2", 10, 0.0, 1e9)]
Milliseconds = Annotated[int, Whole(0, LARGEST_MS)]
Count = Annotated[int, Whole(0, 2**31 - 1)]
YesNo = Annotated[bool, Flag()]
Identifier = Annotated[str, Words(40, IDENTIFIER)]
OptionalIdentifier = Annotated[str, Words(40, re.compile(r"[a-z0-9_-]*"))]
Digest = Annotated[str, Words(64, re.compile(r"[0-9a-f]{64}"))]
Text = Annotated[str, Words(LONGEST_TEXT)]
ProbabilityCurve = Annotated[NDArray[np.float64], Packed(1, "<u2", 4096, 10_000, 0.999)]
ProbabilityLook = Annotated[NDArray[np.float64], Packed(3, "<u2", 65_536, 10_000, 0.999)]
Levels = Annotated[NDArray[np.uint8], Packed(2, "u1", 1024)]
LONGEST_KEY = 200
LONGEST_LETTER = 150_000  # bytes of a message that was heard across the water, as its readers get it
LONGEST_FRAME = 4096  # bytes
Key = Annotated[str, Words(LONGEST_KEY, re.compile(r"[a-z0-9_/-]+"))]
Letter = Annotated[bytes, Octets(LONGEST_LETTER)]
FrameBytes = Annotated[bytes, Octets(LONGEST_FRAME)]
CellMask = Annotated[NDArray[np.bool_], Mask(1024)]

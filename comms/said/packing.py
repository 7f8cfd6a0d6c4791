"""Messages packed to the bit, in the manner of the DCCL standard, for a modem that carries tens of bits a second.

A message type says field by field how it crosses (`comms.said.over_water`); yes or no, an enumeration, a `Probability`
and a `Count` need not. What is packed is the value as it is on the wire, and what is got is one that could be on the
wire: so what has crossed may be said on any bus. No checksum is packed; damage is for the modem's frames to notice.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

from comms.said.bits import BitReader, BitWriter
from comms.said.over_water import Around, Counted, Fine, Follows, NotOverWater, Number, OneOf, OnlyWhen, Profile, Share
from comms.said.wire import MISFITS, AtMost, Count, Flag, Probability, WireError, record_of

M = TypeVar("M")


class _Field(NamedTuple):
    name: str
    where: str
    note: Any
    only_when: OnlyWhen | None
    follows: Follows | None
    fine: Fine | None


class _Packing:
    """How the fields of one class are packed, or the single value of a tuple's entry, as the field ""."""

    def __init__(self, hints: Mapping[str, Any], where: str) -> None:
        self.fields = [_field_of(name, hint, f"{where}.{name}" if name else where) for name, hint in hints.items()]

    def put(self, writer: BitWriter, said: Mapping[str, Any], around: Around, earlier: list[dict[str, int]]) -> None:
        """Writes fields by their names; `earlier`: the steps of the entries before, to which these are added."""
        all_steps, off = dict[str, int](), dict[str, int]()
        for name, where, note, only_when, follows, fine in self.fields:
            if only_when is not None and said[only_when.field] not in only_when.values:
                continue
            if fine is not None and around.coarse:
                continue
            try:
                if not isinstance(note, Number):
                    note.put(writer, said[name], around, said)
                    continue
                most = note.most(around)
                steps = all_steps[name] = _within(note.steps(said[name], around), most)
                if follows is not None and earlier:
                    off[name] = steps - follows.expected(name, earlier, off, around)
                    writer.write_signed(off[name], follows.order_in(around))
                elif most is None:
                    writer.write_count(steps, note.order(around))
                else:
                    writer.write(steps, most.bit_length())
            except MISFITS as error:
                raise WireError(f"{where}: {error}") from None
        earlier.append(all_steps)

    def get(self, reader: BitReader, around: Around, earlier: list[dict[str, int]]) -> dict[str, Any]:
        """The fields that `put` has written."""
        said: dict[str, Any] = {}
        all_steps, off = dict[str, int](), dict[str, int]()
        for name, where, note, only_when, follows, fine in self.fields:
            if only_when is not None and said[only_when.field] not in only_when.values:
                said[name] = 0
                continue
            if fine is not None and around.coarse:
                said[name] = fine.instead
                continue
            try:
                if not isinstance(note, Number):
                    said[name] = note.get(reader, around, said)
                    continue
                most = note.most(around)
                if follows is not None and earlier:
                    off[name] = reader.read_signed(follows.order_in(around))
                    steps = follows.expected(name, earlier, off, around) + off[name]
                elif most is None:
                    steps = reader.read_count(note.order(around))
                else:
                    steps = reader.read(most.bit_length())
                all_steps[name] = _within(steps, most)
                said[name] = note.value(steps, around)
            except MISFITS as error:
                raise WireError(f"{where}: {error}") from None
        earlier.append(all_steps)
        return said


def _within(steps: int, most: int | None) -> int:
    if steps < 0 or (most is not None and steps > most):
        raise WireError(f"{steps} steps are outside 0 to {most}")
    return steps


class _Many(NamedTuple):
    """A tuple: how many entries, and each."""

    entry: _Packing
    most: int
    taken: Callable[[Any], Mapping[str, Any]]
    made: Callable[[dict[str, Any]], Any]

    def put(self, writer: BitWriter, value: tuple[Any, ...], around: Around, said: Mapping[str, Any]) -> None:
        writer.write_count(len(value), 3)
        earlier: list[dict[str, int]] = []
        for one in value:
            self.entry.put(writer, self.taken(one), around, earlier)

    def get(self, reader: BitReader, around: Around, said: Mapping[str, Any]) -> tuple[Any, ...]:
        count = _how_many(reader, self.most)
        earlier: list[dict[str, int]] = []
        return tuple(self.made(self.entry.get(reader, around, earlier)) for _ in range(count))


class _Counts(NamedTuple):
    """A tuple of small numbers from 0: how many there may be."""

    most: int

    def put(self, writer: BitWriter, value: tuple[int, ...], around: Around, said: Mapping[str, Any]) -> None:
        writer.write_count(len(value), 3)
        writer.write_counts(value, _SMALL_COUNT.order(around))

    def get(self, reader: BitReader, around: Around, said: Mapping[str, Any]) -> tuple[int, ...]:
        return reader.read_counts(_SMALL_COUNT.order(around), _how_many(reader, self.most))


def _how_many(reader: BitReader, most: int) -> int:
    count = reader.read_count(3)
    if count > most:
        raise WireError(f"{count} entries are more than {most}")
    return count


_SMALL_COUNT = Counted(0)
_BY_KIND = {get_args(Probability)[1]: Share(), get_args(Count)[1]: Counted(), Flag(): OneOf((False, True))}


def _field_of(name: str, hint: Any, where: str) -> _Field:
    notes = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    only_when = next((one for one in notes if isinstance(one, OnlyWhen)), None)
    follows = next((one for one in notes if isinstance(one, Follows)), None)
    fine = next((one for one in notes if isinstance(one, Fine)), None)
    return _Field(name, where, _packed_by(hint, notes, where), only_when, follows, fine)


def _packed_by(hint: Any, notes: tuple[Any, ...], where: str) -> Any:
    for note in notes:
        if isinstance(note, Number | Profile | NotOverWater):
            return note
    for note in notes:
        if isinstance(note, AtMost):
            entry = get_args(get_args(hint)[0])[0]
            if entry == Annotated[Count, _SMALL_COUNT]:
                return _Counts(note.count)
            if isinstance(entry, type) and is_dataclass(entry):
                return _Many(_packing_of(entry), note.count, _taken, partial(_made, entry))
            return _Many(_Packing({"": entry}, where), note.count, lambda one: {"": one}, lambda said: said[""])
        if note in _BY_KIND:
            return _BY_KIND[note]
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return OneOf(tuple(hint))
    raise TypeError(f"{where}: nothing says how it crosses the water")


_PACKINGS: dict[object, _Packing] = {}


def _packing_of(cls: Any) -> _Packing:
    """How a class is packed, made once. Raises TypeError where a field is not declared."""
    if cls not in _PACKINGS:
        hints = get_type_hints(cls, include_extras=True)
        _PACKINGS[cls] = _Packing({one.name: hints[one.name] for one in fields(cls)}, cls.__name__)
    return _PACKINGS[cls]


def _taken(record: Any) -> Mapping[str, Any]:
    return {one.name: getattr(record, one.name) for one in _packing_of(type(record)).fields}


def _made(cls: type[Any], said: dict[str, Any]) -> Any:
    return cls(**said)


def put_message(writer: BitWriter, message: Any, around: Around) -> None:
    """Writes a message. Raises WireError where a field does not fit, as a place outside the box, and TypeError where
    messages of its type do not cross the water."""
    packing, record = _packing_of(type(message)), record_of(type(message))
    packing.put(writer, _taken(record.decode(record.encode(message))), around, [])


def get_message(reader: BitReader, message_type: type[M], around: Around) -> M:
    """The message that was put with the same `around`. Raises WireError, and nothing else, where there is none of that
    type, and TypeError where messages of that type do not cross the water."""
    packing, record = _packing_of(message_type), record_of(message_type)
    message: M = record.decode(record.encode(message_type(**packing.get(reader, around, []))))
    return message


def skip_message(reader: BitReader, message_type: type[Any], around: Around) -> None:
    """Reads on to the end of a message that was put with the same `around`, whether or not it could be on the wire.
    Raises WireError, and nothing else, where there is none of that type."""
    _packing_of(message_type).get(reader, around, [])

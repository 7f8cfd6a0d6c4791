"""What a stream says again from its beginning, where the receiver's modem was started anew."""

from __future__ import annotations

import pytest

from comms.said.bits import BitReader, BitWriter
from modem.streams import Receiving, Sending, Window


def begin(sending: Sending, value: int) -> None:
    said = BitWriter()
    said.write(value, 24)
    sending.begin(said, 1.0, 0)


def read(letters: list[BitReader]) -> list[int]:
    return [one.read(24) for one in letters]


@pytest.mark.parametrize("window", [Window(3, tells_behind=False, turn_bits=0), Window(3), Window(5)])
def test_messages_that_were_acknowledged_in_part_are_left_out_and_others_said_again(window: Window) -> None:
    sending = Sending(window)
    begin(sending, 0xABCDEF)
    sending.cut(12, 0)
    sending.hear(0, 1, 0)
    sending.cut(12, 0)
    begin(sending, 0x123456)
    sending.cut(8, 0)  # its other pieces are yet to be cut
    sending.begin_again()
    sending.cut(16, 0)
    receiving = Receiving(window, in_order=True)
    told = [receiving.take(sending.turn, number, one.piece) for number, one in sorted(sending.unheard.items())]
    assert [read(letters) for letters in told] == [[], [0x123456]]


def test_what_is_yet_to_be_cut_is_left_out_with_what_was_acknowledged() -> None:
    sending = Sending(Window(5))
    begin(sending, 0xABCDEF)
    sending.cut(12, 0)
    sending.hear(0, 1, 0)
    sending.begin_again()
    assert sending.is_quiet
    begin(sending, 0x123456)
    number, piece = sending.cut(24, 0)
    assert (number, piece.whole, piece.value) == (0, True, 0x123456)


def test_a_message_of_which_a_piece_in_the_middle_had_come_is_left_out() -> None:
    sending = Sending(Window(5))
    begin(sending, 0xABCDEF)
    for _ in range(4):
        sending.cut(6, 0)
    sending.hear(0, 0, 0b1)  # its second piece
    assert sorted(sending.unheard) == [0, 2, 3]
    sending.begin_again()
    assert sending.is_quiet

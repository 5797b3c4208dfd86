"""Messages from a table of fields, and numbers byte by byte as protobuf's documentation of its encoding has them."""

import pytest

from racecraft.formats.protobuf_messages import MessageError, message_classes, parsed, read_varint, varint

NUMBERS = {
    0: "00", 1: "01", 127: "7f", 128: "8001", 150: "9601", 300: "ac02", 16383: "ff7f", 16384: "808001",
    2**63: "80808080808080808001", 2**64 - 1: "ffffffffffffffffff01",
}  # fmt: skip


@pytest.mark.parametrize("number", NUMBERS)
def test_a_number_has_seven_bits_a_byte_the_low_ones_first(number):
    written = varint(number)
    assert written.hex() == NUMBERS[number]
    assert read_varint(b"\xff" + written + b"\xff", 1) == (number, 1 + len(written))


def test_a_number_of_ten_bytes_is_cut_to_64_bits_and_one_of_eleven_is_none():
    assert read_varint(b"\xff" * 9 + b"\x7f", 0) == (2**64 - 1, 10)
    with pytest.raises(MessageError, match="more than 10 bytes at byte 1"):
        read_varint(b"\0" + b"\x80" * 10 + b"\x01", 1)
    with pytest.raises(MessageError, match="end in the middle of a number at byte 2"):
        read_varint(b"\0\0\x80\x80", 2)


def test_two_tables_may_describe_messages_of_the_same_name():
    first = message_classes("same", {"Row": "1:size:int32"})["Row"]
    second = message_classes("same", {"Row": "1:name:string"})["Row"]
    assert parsed(first, b"\x08\x07").size == 7
    assert parsed(second, b"\x0a\x01a").name == "a"


@pytest.mark.parametrize("data", [b"\x0a\x05ab", b"\x0b", b"\x00\x01", b"\x0a\x01\xff", b"\xff" * 11])
def test_bytes_that_are_no_message_are_refused_with_its_name(data):
    """A length beyond the end, a group without its end, field 0, a text of no UTF-8, an endless number."""
    row = message_classes("same", {"Row": "1:name:string"})["Row"]
    with pytest.raises(MessageError, match=f"{len(data)} bytes are no Row"):
        parsed(row, data)

"""Protocol buffers byte by byte, as the encoding page of their documentation has them."""

import pytest

from racecraft.worlds.deepracer.files.tensorflow.wire import (
    WireError,
    as_bytes,
    as_float,
    as_number,
    as_signed,
    as_text,
    bytes_field,
    fields,
    fixed32_field,
    float_field,
    read_varint,
    varint,
    varint_field,
)

NUMBERS = {
    0: "00", 1: "01", 127: "7f", 128: "8001", 150: "9601", 300: "ac02", 16383: "ff7f", 16384: "808001",
    2**63: "80808080808080808001", 2**64 - 1: "ffffffffffffffffff01",
}  # fmt: skip


@pytest.mark.parametrize("number", NUMBERS)
def test_a_number_has_seven_bits_a_byte_the_low_ones_first(number):
    written = varint(number)
    assert written.hex() == NUMBERS[number]
    assert read_varint(b"\xff" + written + b"\xff", 1) == (number, 1 + len(written))


def test_negative_numbers_wrap_round_at_64_bits():
    assert varint(-1) == varint(2**64 - 1)
    assert [as_signed(2**64 + number if number < 0 else number, "a size") for number in (-1, -(2**63), 2**63 - 1)] == [
        -1, -(2**63), 2**63 - 1,
    ]  # fmt: skip


def test_a_number_of_ten_bytes_is_cut_to_64_bits_and_one_of_eleven_is_none():
    assert read_varint(b"\xff" * 9 + b"\x7f", 0) == (2**64 - 1, 10)
    with pytest.raises(WireError, match="more than 10 bytes at byte 1"):
        read_varint(b"\0" + b"\x80" * 10 + b"\x01", 1)
    with pytest.raises(WireError, match="end in the middle of a number at byte 2"):
        read_varint(b"\0\0\x80\x80", 2)


def test_each_kind_of_field_begins_with_its_number_and_kind():
    """Field 1 with 150, and field 2 with "testing", are the page's own examples."""
    assert varint_field(1, 150).hex() == "089601"
    assert bytes_field(2, "testing").hex() == "120774657374696e67"
    assert bytes_field(2, b"testing") == bytes_field(2, "testing")
    assert fixed32_field(3, 258).hex() == "1d02010000"
    assert float_field(4, 1.5).hex() == "250000c03f"
    assert varint_field(16, 0).hex() == "800100"


def test_fields_come_back_in_their_order():
    eight = b"\x29" + (2**40 + 1).to_bytes(8, "little")
    message = bytes_field(2, b"ab") + varint_field(1, 7) + fixed32_field(3, 258) + eight + bytes_field(20, b"")
    told = [(number, value if isinstance(value, int) else bytes(value)) for number, value in fields(message)]
    assert told == [(2, b"ab"), (1, 7), (3, 258), (5, 2**40 + 1), (20, b"")]
    assert list(fields(b"")) == []


@pytest.mark.parametrize(
    ("message", "letter"),
    [
        (b"\x12\x02a", "field 2 claims 2 bytes at byte 2, 1 are left"),
        (b"\x08\x01\x1d\0\0\0", "field 3 claims 4 bytes at byte 3, 3 are left"),
        (b"\x29" + b"\0" * 7, "field 5 claims 8 bytes at byte 1, 7 are left"),
        (b"\x08", "the bytes end in the middle of a number at byte 1"),
        (b"\x08\x01\x00\x01", "field number 0 at byte 3"),
        (b"\x0c", "field 1 is of the unknown wire type 4 at byte 1"),
        (b"\x0e", "field 1 is of the unknown wire type 6 at byte 1"),
        (b"\x0f", "field 1 is of the unknown wire type 7 at byte 1"),
    ],
)
def test_bytes_that_end_too_early_or_are_no_field_are_refused(message, letter):
    with pytest.raises(WireError, match=letter):
        list(fields(message))


def test_a_value_is_what_its_reader_asks_for_or_is_refused():
    view = memoryview("Zürich".encode())
    assert (as_number(3, "x"), as_text(view, "x"), as_float(0x3FC00000, "x")) == (3, "Zürich", 1.5)
    assert as_bytes(view, "x") is view
    for read, value, letter in (
        (as_number, view, "x is bytes where a number belongs"),
        (as_signed, view, "x is bytes where a number belongs"),
        (as_float, view, "x is bytes where a number belongs"),
        (as_bytes, 3, "x is a number where bytes belong"),
        (as_text, 3, "x is a number where bytes belong"),
        (as_text, view[:2], "x is no UTF-8 text"),
    ):
        with pytest.raises(WireError, match=letter):
            read(value, "x")

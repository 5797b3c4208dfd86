"""Protobuf's bytes, read without protobuf: by hand, from its own documents."""

import struct

import pytest

from racecraft.worlds.unity.files.protobuf_wire import read_fields, read_varint


def test_bytes_and_texts_are_read_and_a_number_in_their_place_is_not():
    fields = read_fields(b"\x0a\x02hi\x10\x96\x01\x1d\x00\x00\xc0\x3f")
    assert fields.decimal(3) == 1.5
    assert (fields.data(1), fields.text(1), fields.data(7)) == (b"hi", "hi", b"")
    with pytest.raises(ValueError, match="field 2 should be bytes and is the number 150"):
        fields.data(2)


def test_what_is_not_there_is_nothing_as_protobuf_has_it():
    fields = read_fields(b"")
    assert (fields.data(1), fields.text(1), fields.decimal(1), fields.whole(1)) == (b"", "", 0.0, 0)


@pytest.mark.parametrize(
    ("data", "number"),
    [(b"\0", 0), (b"\x7f", 127), (b"\x80\x01", 128), (b"\x80\x80\x01", 16384), (b"\xff\x01", 255), (b"\x81\x01", 129)],
)
def test_a_number_is_seven_bits_a_byte_the_lowest_first(data, number):
    assert read_varint(data, 0) == (number, len(data))
    for cut in range(len(data)):
        with pytest.raises(ValueError, match="in the middle"):
            read_varint(data[:cut], 0)


def test_of_a_field_that_stands_twice_the_last_one_is_meant():
    """Fields 1 (a number) and 2 (bytes), each twice."""
    fields = read_fields(b"\x08\x01\x08\x05" + b"\x12\x01a\x12\x01b")
    assert (fields.whole(1), fields.data(2)) == (5, b"b")


def test_negative_numbers_are_written_as_64_bits():
    """Ten bytes: -1 is 2**64 - 1, and the smallest number 2**63; the largest, 2**63 - 1, has nine."""
    assert read_fields(b"\x08" + b"\xff" * 9 + b"\x01").whole(1) == -1
    assert read_fields(b"\x08" + b"\x80" * 9 + b"\x01").whole(1) == -(2**63)
    assert read_fields(b"\x08" + b"\xff" * 8 + b"\x7f").whole(1) == 2**63 - 1


def test_a_number_ends_after_ten_bytes_and_what_is_above_its_64_bits_is_left_out():
    assert read_varint(b"\xff" * 9 + b"\x7f", 0) == (2**64 - 1, 10)
    with pytest.raises(ValueError, match="longer than ten bytes"):
        read_varint(b"\x80" * 10 + b"\x00", 0)


@pytest.mark.parametrize("data", [b"\x08\x07\x08\xac\x02", b"\x0a\x03\x07\xac\x02"])
def test_numbers_of_a_list_stand_each_alone_or_packed(data):
    """300 is 0xac 0x02."""
    assert read_fields(data).wholes(1) == [7, 300]


@pytest.mark.parametrize("head", [(b"\x0d", b"\x0d"), (b"\x0a\x08", b"")])
def test_decimals_of_a_list_stand_each_alone_or_packed(head):
    data = head[0] + struct.pack("<f", 1.5) + head[1] + struct.pack("<f", -2.0)
    assert read_fields(data).decimals(1).tolist() == [1.5, -2.0]


def test_messages_are_read_in_their_order_and_what_is_not_there_is_none():
    """Two messages in field 1, whose field 1 is 5 and 6."""
    told = read_fields(b"\x0a\x02\x08\x05\x0a\x02\x08\x06")
    assert [message.whole(1) for message in told.messages(1)] == [5, 6]
    assert told.messages(2) == []


def test_fields_of_eight_bytes_are_passed_over():
    fields = read_fields(b"\x09" + b"12345678" + b"\x10\x03")
    assert (fields.data(1), fields.whole(2)) == (b"12345678", 3)


@pytest.mark.parametrize(
    ("data", "ask", "letter"),
    [
        (b"\x0a\x01a", lambda fields: fields.whole(1), "field 1 should be a whole number and is 1 bytes"),
        (b"\x0a\x03abc", lambda fields: fields.decimal(1), "field 1 should be 4 bytes and is 3"),
        (b"\x08\x01", lambda fields: fields.messages(1), "field 1 should be messages and holds numbers"),
        (b"\x08\x01", lambda fields: fields.decimals(1), "field 1 should be floats of four bytes each"),
        (b"\x0a\x05abcde", lambda fields: fields.decimals(1), "field 1 should be floats of four bytes each"),
        (b"\x0a\x05ab", None, "field 1 claims 5 bytes where 2 are left"),
        (b"\x15ab", None, "field 2 claims 4 bytes where 2 are left"),
        (b"\x0b", None, "field 1 is of kind 3"),
        (b"\x00\x01", None, "a field has the number 0"),
    ],
)
def test_what_is_not_what_it_should_be_is_named(data, ask, letter):
    with pytest.raises(ValueError, match=letter):
        ask(read_fields(data))

"""Protobuf's bytes, read without protobuf: by hand, from its own documents."""

import pytest

from racecraft.formats.unity.protobuf_wire import read_fields, read_varint


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

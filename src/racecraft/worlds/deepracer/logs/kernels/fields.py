"""Fields whose two ends are known: which commas and ends of lines there are, and what stands between two of them.

Begin with `find_marks`, then `float_between`. Nothing here goes round in a loop or takes one of two ways by what a
number looks like, as far as that can be had: a processor that guessed its way wrong has lost more time than the whole
number takes. What these few ways do not cover is "not sure", and is read by `decimals` from its first byte.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import inner_kernel, kernel
from racecraft.kernels.bits import decimal_digits, fused, ones, same_bytes, trailing_zeros, whole_digits, word_at
from racecraft.worlds.deepracer.logs.kernels.decimals import number_of, product
from racecraft.worlds.deepracer.logs.limits import HIGHEST

_U = np.uint64
_0, _1, _8 = _U(0), _U(1), _U(8)
_ALL = _U(0xFFFFFFFFFFFFFFFF)
_BYTE = _U(0xFF)
_ZEROS = _U(0x3030303030303030)
_TO_HIGH_BIT = _U(0x7676767676767676)
_HIGH_BITS = _U(0x8080808080808080)
_POINT_ZERO = _U(0x302E)
_MINUS = _U(0x2D)
_MOST_LETTERS = 31
_EXACT_LETTERS = 15
"""So many digits and their power of ten are exact in a float, and one division rounds them right."""
_TENS = np.array([float(10**k) for k in range(32)])
_SIGNED_TENS = np.concatenate([_TENS, -_TENS])
_MOST_EXACT_TEN = 1e22
"""The highest power of ten that a float holds exactly."""
_MOST_DIVIDED = 1 << 62
_MOST_WHOLE_DIGITS = round(math.log10(HIGHEST))
_KEPT_BITS = 6
KEPT = 1 << _KEPT_BITS
_ZERO_ALONE = _U(ord("0") << 56)
_SPREAD = _U(0x9E3779B97F4A7C15)
"""An odd number whose multiples lie far apart: the golden section of 2^64 (Knuth, volume 3, 6.4)."""
_MARKS_AT_ONCE = 8
"""As many as the fields of 64 bytes, mostly."""
SPARE_MARKS = _MARKS_AT_ONCE - 1
_COMMA, _NEW_LINE = np.uint8(ord(",")), np.uint8(ord("\n"))

BYTES_BEFORE = 40
"""Bytes that must be readable before a text, so that a word may be looked at wherever it begins."""


@kernel
def find_marks(text, begin, end, marks, line_marks):
    """Find the commas and the ends of lines in a text; up to 63 bytes behind it are looked at.

    Args:
        text: Address of the first byte.
        begin: Where to begin.
        end: Where to end.
        marks: int32, written: where each of them stands, with room for one a byte and SPARE_MARKS.
        line_marks: int32, written: which of the marks are ends of lines.

    Returns:
        How many marks and how many ends of lines there are.
    """
    count = lines = 0
    for at in range(begin, end, 64):
        ends = same_bytes(text, at, _NEW_LINE)
        found = same_bytes(text, at, _COMMA) | ends
        if at + 64 > end:
            inside = _ALL >> _U(at + 64 - end)
            ends, found = ends & inside, found & inside
        while ends != _0:
            lowest = ends & (~ends + _1)
            line_marks[lines] = count + ones(found & (lowest - _1))
            lines += 1
            ends ^= lowest
        here = count + ones(found)
        while found != _0:  # a few at once, some of them for nothing: a processor guesses seldom when it is enough
            for more in range(_MARKS_AT_ONCE):
                marks[count + more] = at + trailing_zeros(found)
                found &= found - _1
            count += _MARKS_AT_ONCE
        count = here
    return count, lines


@inner_kernel
def _no_digits(bits):
    """Return something other than 0 where a byte of a word, 0x30 taken away, is no digit."""
    return ((bits + _TO_HIGH_BIT) | bits) & _HIGH_BITS


@inner_kernel
def is_the_same(text, start, stop, start_before, stop_before):
    """Tell whether a field of 8 to 24 bytes is one that was read before; of a shorter or longer one it says no."""
    if word_at(text, start) != word_at(text, start_before):  # first, since a processor guesses it right
        return False
    length = stop - start
    return (
        (length == stop_before - start_before)
        & (8 <= length <= 24)
        & (word_at(text, start + 8) == word_at(text, start_before + 8))
        & (word_at(text, stop - 8) == word_at(text, stop_before - 8))
    )


@kernel
def no_numbers_yet(columns):
    """Return room for numbers that come again: (columns, KEPT) fields of a letter to eight, and their values.

    Every place begins with the field "0".
    """
    return np.full((columns, KEPT), _ZERO_ALONE), np.zeros((columns, KEPT))


@inner_kernel
def _kept_at(field):
    """Return the place of a short field among those that are kept."""
    return np.int64((field * _SPREAD) >> _U(64 - _KEPT_BITS))


@inner_kernel
def _short_field(text, start, stop):
    """Return a field of one to eight letters, moved up to the highest byte."""
    return word_at(text, start) << (_8 * _U(8 - (stop - start)))


@inner_kernel
def may_be_kept(text, start, stop, fields):
    """Tell whether a field is one of one to eight letters that was read before, or would push out none that was."""
    if not 0 < stop - start <= 8:
        return False
    field = _short_field(text, start, stop)
    kept = fields[_kept_at(field)]
    return (kept == field) | (kept == _ZERO_ALONE)


@inner_kernel
def short_float(text, start, stop, fields, values):
    """Read a number of one to eight letters as `float_between` does; look first whether it was read before.

    A table of actions has few angles and few speeds, and most rows are paid one of few rewards.

    Args:
        text: Address of the first byte.
        start: Where the field begins.
        stop: Where it ends.
        fields: uint64 (KEPT,), the fields that were read, moved up to the highest byte; read and written.
        values: float64 (KEPT,), their numbers; read and written.
    """
    field = _short_field(text, start, stop)
    place = _kept_at(field)
    if fields[place] == field:
        return values[place], True
    value, sure = float_between(text, start, stop)
    if sure:
        fields[place], values[place] = field, value
    return value, sure


@inner_kernel
def float_between(text, start, stop):
    """Read a number such as -12.5 or 7 that fills a field; return it and whether it is sure."""
    negative = (word_at(text, start) & _BYTE) == _MINUS
    start += negative
    if not 0 < stop - start <= _MOST_LETTERS:
        return 0.0, False
    number, places, sure = decimal_digits(text, start, stop)
    if stop - start <= _EXACT_LETTERS:
        value = np.float64(np.int64(number)) / _TENS[places]
    else:
        value, exact = product(number, places)
        sure &= exact
    return value * (1.0 - 2.0 * negative), sure & (value < HIGHEST)


@kernel
def room_for_numbers(count):
    """Return room for so many numbers taken apart: where their fields begin and end, their digits, powers of ten."""
    return np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.uint64), np.empty(count)


@inner_kernel
def digits_between(text, start, stop):
    """Take a number such as -12.5 or 7 that fills a field apart.

    Returns:
        Its digits, uint64; the power of ten that they are to be divided by, negative where the number is; and whether
        it is one.
    """
    negative = np.int64((word_at(text, start) & _BYTE) == _MINUS)
    start += negative
    digits, places, sure = decimal_digits(text, start, stop)
    sure &= (stop > start) & (stop - start <= _MOST_LETTERS)
    return digits, _SIGNED_TENS[_U(32 * negative) | _U(places)], sure


@inner_kernel
def divide(digits, tens, quotients, left):
    """Divide whole numbers by powers of ten, correctly rounded; several at once.

    A quotient q of what a float holds of a number lacks c, which is no more than q's last place and known to some
    fifty bits. Where q + c is rounded the same with a little more and with a little less, it is right. The little is
    q * 2^-98; c is wrong by less than q * 2^-102, as each of its three roundings is by less than q * 2^-104.

    Args:
        digits: uint64 (N,).
        tens: float64 (N,), with signs.
        quotients: float64 (N,), written.
        left: bool (N,), set where the quotient is not sure.
    """
    for k in range(len(digits)):
        number, ten = np.int64(digits[k]), tens[k]
        held = np.float64(number)
        quotient = held / ten
        lacking = (fused(-quotient, ten, held) + np.float64(number - np.int64(held))) / ten
        little = quotient * 2.0**-98
        right = quotient + (lacking + little)
        sure = (right == quotient + (lacking - little)) & (abs(right) < HIGHEST)
        sure &= (number >= 0) & (number < _MOST_DIVIDED) & (abs(ten) <= _MOST_EXACT_TEN)
        quotients[k] = right
        left[k] |= not sure


@inner_kernel
def is_plain_float(text, start, stop):
    """Tell whether `float_between` or `decimals` could read the number that fills a field, without reading it."""
    start += (word_at(text, start) & _BYTE) == _MINUS
    length = stop - start
    return (length > 0) & (length <= _MOST_LETTERS) & (whole_digits(text, start, stop) <= _MOST_WHOLE_DIGITS)


@inner_kernel
def whole_between(text, start, stop):
    """Read a whole number of up to seven digits, such as 7 or 7.0, that fills a field; return it and whether sure."""
    length, word = stop - start, word_at(text, start)
    digits = length
    if length > 2 and (word_at(text, stop - 2) & _U(0xFFFF)) == _POINT_ZERO:
        digits -= 2
    if digits < 1 or digits > 7:
        return np.int32(0), False
    bits = (word ^ _ZEROS) << (_8 * _U(8 - digits))
    return np.int32(number_of(bits)), _no_digits(bits) == _0

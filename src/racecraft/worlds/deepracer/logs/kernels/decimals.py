"""Digits to floats, correctly rounded or not at all.

Begin with `decimal_at`. A text is the address of its first byte, and is looked at eight bytes at a time, so that eight
digits are told and added up at once. Behind its end must stand zeros.

A number of up to 19 digits is a whole number w times a power of ten. Where both are exact in a float, one division
rounds them right. Elsewhere w is multiplied with the power's first 128 bits, and the product is taken only where the
bits that were cut off could not have changed its rounding (Lemire 2021, "Number Parsing at a Gigabyte per Second",
tells the principle). In all other cases the answer is "not sure", and the caller asks someone slower.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import inner_kernel, kernel
from racecraft.kernels.bits import leading_zeros, trailing_zeros, wide_product, word_at

_U = np.uint64
MOST_DIGITS = 19
"""Any whole number of so many digits fits 64 bits."""
MOST_PLACES = 60
"""Places behind the point, exponent included, up to which numbers are read here."""
_SMALL_PLACES = 22
_EXACT = _U(1) << _U(53)

_ZEROS = _U(0x3030303030303030)
_TO_HIGH_BIT = _U(0x7676767676767676)
_HIGH_BITS = _U(0x8080808080808080)
_PAIRS = _U(0x00FF00FF00FF00FF)
_QUADS = _U(0x0000FFFF0000FFFF)
_ALL = _U(0xFFFFFFFFFFFFFFFF)
_0, _1, _8, _16, _32 = (_U(k) for k in (0, 1, 8, 16, 32))

_WHOLE_TENS = np.array([10**k for k in range(9)], np.uint64)
_TENS = np.array([float(10**k) for k in range(_SMALL_PLACES + 1)])


def _powers() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return 10^-e for e from 0 on, cut off after 128 bits: the upper 64, the lower 64, and b of 2^-b times them."""
    upper, lower, shifts = [], [], []
    for places in range(MOST_PLACES + 1):
        shift = (10**places - 1).bit_length()
        power = (1 << (127 + shift)) // 10**places
        upper.append(power >> 64)
        lower.append(power & ((1 << 64) - 1))
        shifts.append(shift)
    return np.array(upper, np.uint64), np.array(lower, np.uint64), np.array(shifts, np.int64)


_UPPER, _LOWER, _SHIFTS = _powers()
_LEAST_TWO = -270
_TWOS = np.array([2.0**k for k in range(_LEAST_TWO, 64)])


@kernel
def digits_at(text, at):
    """Return how many digits stand at a byte, eight at most, and their whole number."""
    bits = word_at(text, at) ^ _ZEROS
    others = ((bits + _TO_HIGH_BIT) | bits) & _HIGH_BITS
    if others == _0:
        count = 8
    else:
        count = trailing_zeros(others) >> 3
        if count == 0:
            return 0, _0
        bits = bits << (_8 * _U(8 - count))
    return count, number_of(bits)


@inner_kernel
def number_of(digits):
    """Return the whole number of eight digits, a byte each, the first one lowest."""
    bits = digits * _U(10) + (digits >> _8)
    bits = (bits & _PAIRS) * _U(6553601) >> _16
    return (bits & _QUADS) * _U(42949672960001) >> _32


@kernel
def whole_at(text, at):
    """Return the digits from a byte on: how many, and their whole number as far as it fits 64 bits."""
    count, number = digits_at(text, at)
    digits = count
    while count == 8:
        count, more = digits_at(text, at + digits)
        number = number * _WHOLE_TENS[count] + more
        digits += count
    return digits, number


@kernel
def decimal_at(text, at):
    """Read a number such as -12.5, 7 or 3e-05.

    Returns:
        The number; the byte behind it; whether it is sure. What begins with no digit is not sure, nor is `nan`.
    """
    negative = (word_at(text, at) & _U(0xFF)) == _U(0x2D)
    if negative:
        at += 1
    begin = at
    digits, number = whole_at(text, at)
    at += digits
    places = 0
    if (word_at(text, at) & _U(0xFF)) == _U(0x2E):
        at += 1
        places, number = _with_fraction(text, at, number)
        at += places
        digits += places
    if digits == 0:
        return 0.0, at, False
    sure = digits <= MOST_DIGITS or digits - _zeros_at(text, begin, digits) <= MOST_DIGITS
    if (word_at(text, at) & _U(0xDF)) == _U(0x45):
        exponent, at = _exponent_at(text, at + 1)
        places -= exponent
    value, exact = scaled(number, places)
    return -value if negative else value, at, sure and exact


@kernel
def _with_fraction(text, at, number):
    """Return how many digits stand behind the point, and the whole number with them behind it."""
    count, more = digits_at(text, at)
    number = number * _WHOLE_TENS[count] + more
    places = count
    while count == 8:
        count, more = digits_at(text, at + places)
        number = number * _WHOLE_TENS[count] + more
        places += count
    return places, number


@kernel
def _zeros_at(text, at, digits):
    """Return with how many zeros these digits begin, the point passed over."""
    zeros = 0
    while zeros < digits:
        byte = word_at(text, at) & _U(0xFF)
        if byte == _U(0x30):
            zeros += 1
        elif byte != _U(0x2E):
            break
        at += 1
    return zeros


@kernel
def _exponent_at(text, at):
    """Return an exponent and the byte behind it; one that no float has where there is none."""
    sign = word_at(text, at) & _U(0xFF)
    if sign == _U(0x2D) or sign == _U(0x2B):
        at += 1
    count, exponent = digits_at(text, at)
    if count == 0 or count > 3:
        return 1000, at
    return (-np.int64(exponent) if sign == _U(0x2D) else np.int64(exponent)), at + count


@kernel
def scaled(number, places):
    """Return a whole number times 10^-places, correctly rounded, and whether that is sure."""
    if places < 0 and number <= _EXACT and places >= -_SMALL_PLACES:
        return np.float64(np.int64(number)) * _TENS[-places], True
    if places < 0 or places > MOST_PLACES:
        return 0.0, number == _0
    return product(number, places)


@inner_kernel
def product(number, places):
    """Return a whole number times 10^-places, 0 to MOST_PLACES, out of 128 bits of the power, and whether it is sure.

    Of a number that a float holds exactly the cut power makes a little too little; that rounds up to it.
    """
    nothing = number == _0
    number |= _U(nothing)
    lead = leading_zeros(number)
    number <<= _U(lead)
    high, low = wide_product(number, _UPPER[places])
    sure = True
    cut = _U(10) + (high >> _U(63))
    half = _1 << (cut - _1)
    rest = high & ((_1 << cut) - _1)
    if (rest == half - _1) & (low + number < low) | (rest == half) & (low == _0):  # the power's lower half may tell
        carry, _ = wide_product(number, _LOWER[places])
        low += carry
        if low < carry:
            high += _1
        rest = high & ((_1 << cut) - _1)
        sure = _U(2) <= low <= _ALL - _U(2)
    kept = (high >> cut) + _U(rest >= half)
    value = np.float64(np.int64(kept)) * _TWOS[np.int64(cut) + 1 - _SHIFTS[places] - lead - _LEAST_TWO]
    return value * np.float64(not nothing), sure

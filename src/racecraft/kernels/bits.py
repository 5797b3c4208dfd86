"""Single machine instructions that Python has no words for; inside a kernel only."""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic

_instruction: Any = intrinsic
_BIT, _WORD, _WIDE, _INDEX = ir.IntType(1), ir.IntType(64), ir.IntType(128), ir.IntType(32)
_BYTE = ir.IntType(8)
_SIXTY_FOUR, _THIRTY_TWO = ir.VectorType(_BYTE, 64), ir.VectorType(_BYTE, 32)


def _everywhere(builder: Any, value: Any, count: int) -> Any:
    """Return a vector of so many times the same."""
    one = builder.insert_element(ir.Constant(ir.VectorType(value.type, count), ir.Undefined), value, _INDEX(0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(_INDEX, count), [0] * count))


def _constant(vector: Any, values: list[int]) -> Any:
    return ir.Constant(vector, values)


@_instruction
def word_at(_context: Any, address: Any, offset: Any) -> Any:
    """Return the eight bytes from an address and an offset on, the first one lowest; nothing is checked."""

    def code(_, builder, __, arguments):
        place = builder.inttoptr(builder.add(*arguments), _WORD.as_pointer())
        return builder.load(place, align=1)

    return types.uint64(types.int64, types.int64), code


@_instruction
def leading_zeros(_context: Any, _number: Any) -> Any:
    """Return how many bits stand before the highest that is set in a uint64 other than 0."""

    def code(_, builder, __, arguments):
        return builder.ctlz(arguments[0], _BIT(1))

    return types.int64(types.uint64), code


@_instruction
def trailing_zeros(_context: Any, _number: Any) -> Any:
    """Return how many bits stand below the lowest that is set in a uint64; 64 where none is."""

    def code(_, builder, __, arguments):
        return builder.cttz(arguments[0], _BIT(0))

    return types.int64(types.uint64), code


@_instruction
def wide_product(_context: Any, _a: Any, _b: Any) -> Any:
    """Return the upper and the lower 64 bits of the product of two uint64."""

    def code(context, builder, signature, arguments):
        product = builder.mul(*(builder.zext(one, _WIDE) for one in arguments))
        halves = [builder.trunc(builder.lshr(product, _WIDE(64)), _WORD), builder.trunc(product, _WORD)]
        return context.make_tuple(builder, signature.return_type, halves)

    return types.UniTuple(types.uint64, 2)(types.uint64, types.uint64), code


@_instruction
def fused(_context: Any, _a: Any, _b: Any, _c: Any) -> Any:
    """Return a * b + c of three float64, rounded once."""

    def code(_, builder, __, arguments):
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), code


@_instruction
def same_bytes(_context: Any, address: Any, offset: Any, byte: Any) -> Any:
    """Return which of the 64 bytes from an address and an offset on are a byte: a bit each, the first one lowest."""

    def code(_, builder, __, arguments):
        place = builder.inttoptr(builder.add(*arguments[:2]), _SIXTY_FOUR.as_pointer())
        same = builder.icmp_unsigned("==", builder.load(place, align=1), _everywhere(builder, arguments[2], 64))
        return builder.bitcast(same, _WORD)

    return types.uint64(types.int64, types.int64, types.uint8), code


@_instruction
def ones(_context: Any, _number: Any) -> Any:
    """Return how many bits of a uint64 are set."""

    def code(_, builder, __, arguments):
        return builder.ctpop(arguments[0])

    return types.int64(types.uint64), code


@_instruction
def decimal_digits(_context: Any, _address: Any, _start: Any, _stop: Any) -> Any:
    """Return the whole number of a text's digits, a point among them passed over, all of them at once.

    Args:
        _address: Of the text's first byte; 33 bytes before `_stop` must be readable.
        _start: Where the first digit stands.
        _stop: Behind the last one, 1 to 31 bytes on.

    Returns:
        The number, uint64; how many digits stand behind the point; and whether these bytes are digits, one at least,
        with one point among them at most, and no more than nineteen digits behind leading zeros.
    """

    def code(context, builder, signature, arguments):
        address, start, stop = arguments
        bytes_at = lambda back: builder.load(  # noqa: E731
            builder.inttoptr(builder.add(address, builder.sub(stop, _WORD(back))), _THIRTY_TWO.as_pointer()), align=1
        )
        plain, moved = bytes_at(32), bytes_at(33)
        lanes = _constant(_THIRTY_TWO, list(range(32)))
        first = builder.and_(builder.trunc(builder.sub(start, stop), _INDEX), _INDEX(31))  # 32 less the length
        points = builder.icmp_unsigned("==", plain, _constant(_THIRTY_TWO, [ord(".")] * 32))
        points = builder.and_(builder.bitcast(points, _INDEX), builder.shl(_INDEX(0xFFFFFFFF), first))
        whole = builder.icmp_unsigned("==", points, _INDEX(0))
        point = builder.select(whole, _INDEX(0xFFFFFFFF), builder.cttz(points, _BIT(0)))  # -1 where there is none
        behind = builder.icmp_signed(">", lanes, _everywhere(builder, builder.trunc(point, _BYTE), 32))
        digits = builder.sub(builder.select(behind, plain, moved), _constant(_THIRTY_TWO, [ord("0")] * 32))
        before = builder.sub(first, builder.zext(whole, _INDEX))  # without a point no lane of digits is given up to it
        inside = builder.icmp_unsigned(">", lanes, _everywhere(builder, builder.trunc(before, _BYTE), 32))
        digits = builder.select(inside, digits, _constant(_THIRTY_TWO, [0] * 32))
        others = builder.icmp_unsigned(">", digits, _constant(_THIRTY_TWO, [9] * 32))
        sound = builder.icmp_unsigned("==", builder.bitcast(others, _INDEX), _INDEX(0))
        sound = builder.and_(sound, builder.icmp_unsigned("<", before, _INDEX(31)))
        sums = digits
        for bits, ten in ((16, 10), (32, 100), (64, 10_000)):  # two neighbours become one, three times
            vector = ir.VectorType(ir.IntType(bits), 256 // bits)
            half = lambda value, vector=vector: _constant(vector, [value] * vector.count)  # noqa: E731
            pair = builder.bitcast(sums, vector)
            upper = builder.lshr(pair, half(bits // 2))
            sums = builder.add(builder.mul(builder.and_(pair, half((1 << bits // 2) - 1)), half(ten)), upper)
        eights = [builder.extract_element(sums, _INDEX(k)) for k in range(4)]
        for eight, most in zip(eights[:2], (0, 999), strict=True):
            sound = builder.and_(sound, builder.icmp_unsigned("<=", eight, _WORD(most)))
        number = eights[1]
        for more in eights[2:]:
            number = builder.add(builder.mul(number, _WORD(10**8)), more)
        places = builder.select(whole, _WORD(0), builder.sub(_WORD(31), builder.zext(point, _WORD)))
        return context.make_tuple(builder, signature.return_type, [number, places, sound])

    return types.Tuple((types.uint64, types.int64, types.boolean))(types.int64, types.int64, types.int64), code


@_instruction
def whole_digits(_context: Any, _address: Any, _start: Any, _stop: Any) -> Any:
    """Return how many digits stand before the point of a plain number: digits, and one point among them at most.

    Args:
        _address: Of the text's first byte; 32 bytes before `_stop` must be readable.
        _start: Where the first digit stands.
        _stop: Behind the last one, 1 to 31 bytes on.

    Returns:
        The count; 32 where it is no plain number, such as a point alone.
    """

    def code(_, builder, __, arguments):
        address, start, stop = arguments
        place = builder.add(address, builder.sub(stop, _WORD(32)))
        text = builder.load(builder.inttoptr(place, _THIRTY_TWO.as_pointer()), align=1)
        first = builder.and_(builder.trunc(builder.sub(start, stop), _INDEX), _INDEX(31))  # 32 less the length
        inside = builder.shl(_INDEX(0xFFFFFFFF), first)
        values = builder.sub(text, _constant(_THIRTY_TWO, [ord("0")] * 32))
        digits = builder.icmp_unsigned("<=", values, _constant(_THIRTY_TWO, [9] * 32))
        points = builder.icmp_unsigned("==", text, _constant(_THIRTY_TWO, [ord(".")] * 32))
        digits, points = (builder.and_(builder.bitcast(one, _INDEX), inside) for one in (digits, points))
        filled = builder.icmp_unsigned("==", builder.or_(digits, points), inside)
        one_point = builder.icmp_unsigned("==", builder.and_(points, builder.sub(points, _INDEX(1))), _INDEX(0))
        some_digit = builder.icmp_unsigned("!=", digits, _INDEX(0))
        plain = builder.and_(builder.and_(filled, one_point), some_digit)
        before = builder.sub(builder.cttz(points, _BIT(0)), first)  # 32 - first where there is no point
        return builder.zext(builder.select(plain, before, _INDEX(32)), _WORD)

    return types.int64(types.int64, types.int64, types.int64), code

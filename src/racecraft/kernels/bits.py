"""Single machine instructions that Python has no words for; inside a kernel only."""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic

_instruction: Any = intrinsic
_BIT, _WORD, _WIDE = ir.IntType(1), ir.IntType(64), ir.IntType(128)


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
    """Return how many bits stand below the lowest that is set in a uint64 other than 0."""

    def code(_, builder, __, arguments):
        return builder.cttz(arguments[0], _BIT(1))

    return types.int64(types.uint64), code


@_instruction
def wide_product(_context: Any, _a: Any, _b: Any) -> Any:
    """Return the upper and the lower 64 bits of the product of two uint64."""

    def code(context, builder, signature, arguments):
        product = builder.mul(*(builder.zext(one, _WIDE) for one in arguments))
        halves = [builder.trunc(builder.lshr(product, _WIDE(64)), _WORD), builder.trunc(product, _WORD)]
        return context.make_tuple(builder, signature.return_type, halves)

    return types.UniTuple(types.uint64, 2)(types.uint64, types.uint64), code

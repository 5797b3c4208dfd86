"""Comma-separated rows to columns; the rows of a log among its other lines. Begin with `read_lines`.

A row that is not plainly sound is left out and its place noted, so that someone slower may look at it.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import inner_kernel, kernel, lean_kernel
from racecraft.kernels.bits import trailing_zeros, word_at
from racecraft.worlds.deepracer.logs.kernels.decimals import decimal_at, digits_at
from racecraft.worlds.deepracer.logs.kernels.fields import (
    SPARE_MARKS,
    digits_between,
    divide,
    find_marks,
    float_between,
    is_plain_float,
    is_the_same,
    may_be_kept,
    no_numbers_yet,
    room_for_numbers,
    short_float,
    whole_between,
)
from racecraft.worlds.deepracer.logs.limits import HIGHEST, HIGHEST_WHOLE

SKIPPED, FLOAT, WHOLE, FLAG, STATUS, ACTION, CHECKED = range(7)
"""What a field is: passed over, a float, a whole number, True or False, a word of a list, an action, a float that
nobody asks for: a row in which it is none is damaged all the same."""

ZEROS_BEHIND = 64
"""Bytes of zeros that must stand behind a text, so that a word may be looked at wherever it ends."""
_BLOCK_BYTES = 1 << 15
"""Text that is read column by column: its lines and what is found in them stay in a core's nearest memory."""

_U = np.uint64
_0 = _U(0)
_BYTE = _U(0xFF)
_HIGH_BITS = _U(0x8080808080808080)
_LOW_BITS = _U(0x0101010101010101)
_NEW_LINES = _U(0x0A0A0A0A0A0A0A0A)
_NEW_LINE, _RETURN, _TAB, _COMMA, _OPENS, _CLOSES = (ord(sign) for sign in "\n\r\t,[]")


def word(letters: str) -> np.uint64:
    """Return up to eight letters as the kernels see them: the first one lowest."""
    return np.uint64(int.from_bytes(letters.encode(), "little"))


_MARK, _REST_OF_MARK, MARK_LENGTH = word("SIM_TRAC"), word("ACE_LOG:"), 14
_MARK_BEGINS = _U(0x5353535353535353)
_TRUE, _FALSE, _FOUR_BYTES, _FIVE_BYTES = word("True"), word("False"), _U((1 << 32) - 1), _U((1 << 40) - 1)


@kernel
def count_lines(data, ends, counts):
    """Count the lines of texts that stand one behind the other.

    Args:
        data: uint8, the texts.
        ends: int64 (T,), where each of them ends.
        counts: int64 (T,), written: how many lines end in it.
    """
    begin = 0
    for place, end in enumerate(ends):
        count = 0
        for byte in data[begin:end]:
            count += byte == _NEW_LINE
        counts[place], begin = count, end


@kernel
def read_lines(
    data, end, begins_whole, marked, kinds, units, statuses, pieces,
    place, floats, wholes, flags, status, lines, files, odd, gaps,
):  # fmt: skip
    """Read the lines of a text that begin before `end`; the columns have room for R of them behind `place`.

    Args:
        data: uint8, the text and ZEROS_BEHIND zeros behind it.
        end: Where no line begins any more; the last one may reach beyond it.
        begins_whole: Whether a line begins at byte 0; else behind the first end of a line.
        marked: Whether rows stand behind SIM_TRACE_LOG: among other lines; else every line is a row.
        kinds: int64 (C,), what each field of a row is; fields of a kind go to its columns in their order.
        units: float64 (number of FLOAT, 2), what the values of a column are multiplied with, then divided by.
        statuses: uint64 (S, 3), words of at most sixteen bytes: the first eight, the others, how many there are.
        pieces: int64 (P, 3), the files that the text is made of: how many lines begin up to the end of each, what is
            to be added to the number of a line counted from 0 in the text, and the file's index.
        place: How many rows of other texts stand in the columns.
        floats: float64 (number of FLOAT, place + R), written.
        wholes: int32 (number of WHOLE and ACTION, place + R), written; a continuous action is -1.
        flags: bool (number of FLAG, place + R), written.
        status: uint8 (place + R,), written.
        lines: int32 (place + R,), written: the number of each row's line in its file.
        files: uint32 (place + R,), written: the index of its file.
        odd: int32 (R, 3), written: begin, end and line of the rows that were left out; the text's first line is 0.
        gaps: int32 (R, 2), written: begin and end of the text between marked rows.

    Returns:
        How many rows, odd rows, gaps and lines there are.
    """
    text, length = data.ctypes.data, len(data) - ZEROS_BEHIND
    at = 0 if begins_whole else _next_line(text, 0, length)
    if at >= end:
        return 0, 0, 0, 0
    stop = _next_line(text, end - 1, length)
    marks, line_marks, starts, first_marks, taken_apart = _room_for(2 * _BLOCK_BYTES)
    short, values = no_numbers_yet(len(floats))
    left = np.zeros(len(odd), np.bool_)
    rows = odds = gap_count = line_count = 0
    in_gap = False
    while at < stop:
        behind = _next_line(text, min(at + _BLOCK_BYTES, stop) - 1, length)
        room = behind - at + 1 + SPARE_MARKS
        if room > len(marks):
            marks, line_marks, starts, first_marks, taken_apart = _room_for(room)
        mark_count, lines_here = find_marks(text, at, behind, marks, line_marks)
        if word_at(text, behind - 1) & _BYTE != _U(_NEW_LINE):
            marks[mark_count], line_marks[lines_here] = behind, mark_count
            lines_here += 1
        count = first = 0
        for line in range(lines_here):
            last = line_marks[line]
            after = min(np.int64(marks[last]) + 1, length)
            start = _behind_mark(text, at, length) if marked else at
            if start < 0:
                if not in_gap:
                    gaps[gap_count, 0] = at
                    gap_count += 1
                in_gap = True
                gaps[gap_count - 1, 1] = after
            else:
                in_gap = False
                while marks[first] < start:
                    first += 1
                counted = last - first == len(kinds) - 1
                starts[count], first_marks[count] = start, first if counted else 0
                lines[place + rows + count], left[rows + count] = line_count + line, not counted
                count += 1
            at, first = after, last + 1
        to = place + rows
        left_here = left[rows : rows + count]
        _read_columns(
            text, count, starts, first_marks, marks.ctypes.data, kinds, statuses, to, floats, wholes, flags,
            status[to:], left_here, short, values, taken_apart,
        )  # fmt: skip
        for row in range(count):
            if left_here[row]:
                sound = _read_row(text, starts[row], length, to + row, kinds, statuses, floats, wholes, flags, status)
                left_here[row] = sound < 0
                if left_here[row]:
                    odd[odds, 0], odd[odds, 1] = starts[row], _next_line(text, starts[row], length)
                    odd[odds, 2] = lines[to + row]
                    odds += 1
        _convert(floats, to, to + count, units)
        rows, line_count = rows + count, line_count + lines_here
    if odds:
        rows = _close_ranks(left[:rows], place, floats, wholes, flags, status, lines)
    _tell_files(lines[place : place + rows], files[place : place + rows], pieces)
    return rows, odds, gap_count, line_count


@kernel
def _room_for(count):
    """Return room for so many marks, which of them end lines, where rows begin, their first marks, and for a column."""
    marks, line_marks = np.zeros(count, np.int32), np.empty(count, np.int32)
    return marks, line_marks, np.empty(count, np.int32), np.empty(count, np.int32), room_for_numbers(count)


@inner_kernel
def _convert(floats, begin, end, units):
    """Multiply and divide these rows of the columns that have other units."""
    for number in range(len(floats)):
        column = floats[number, begin:end]
        factor, divisor = units[number]
        if factor != 1.0:
            for row in range(len(column)):
                column[row] *= factor
        if divisor != 1.0:
            for row in range(len(column)):
                column[row] /= divisor


@inner_kernel
def _tell_files(lines, files, pieces):
    """Number lines by their files instead of by the whole text, and write which file each stands in."""
    begin = 0
    for piece in range(len(pieces)):
        end = _first_from(lines, begin, pieces[piece, 0])
        for row in range(begin, end):
            lines[row] += np.int32(pieces[piece, 1])
            files[row] = np.uint32(pieces[piece, 2])
        begin = end


@inner_kernel
def _first_from(numbers, begin, least):
    """Return where the first number from `begin` on stands that is no less than `least`, of numbers that grow."""
    end = len(numbers)
    while begin < end:
        middle = (begin + end) // 2
        if numbers[middle] < least:
            begin = middle + 1
        else:
            end = middle
    return begin


@lean_kernel
def _read_columns(
    text, count, starts, first_marks, marks, kinds, statuses, place, floats, wholes, flags, status, left, short, values,
    taken_apart,
):  # fmt: skip
    """Read so many rows, column by column, so that a processor guesses right; `left` tells the not plainly sound."""
    float_count = whole_count = flag_count = 0
    last = len(kinds) - 1
    for field in range(len(kinds)):
        kind = kinds[field]
        if kind == FLOAT:
            column = floats[float_count, place:]
            kept = short[float_count], values[float_count]
            _float_column(text, field, last, count, starts, first_marks, marks, column, left, *kept, taken_apart)
            float_count += 1
        elif kind == CHECKED:
            _check_column(text, field, last, count, starts, first_marks, marks, left)
        elif kind in (WHOLE, ACTION):
            counts = wholes[whole_count, place:]
            _whole_column(text, field, last, count, starts, first_marks, marks, counts, left, kind == ACTION)
            whole_count += 1
        elif kind == FLAG:
            column_of_flags = flags[flag_count, place:]
            _flag_column(text, field, last, count, starts, first_marks, marks, column_of_flags, left)
            flag_count += 1
        elif kind == STATUS:
            _status_column(text, field, last, count, starts, first_marks, marks, statuses, status, left)


@inner_kernel
def _ends_of(text, field, last, row, starts, first_marks, marks):
    """Return where a field of a row begins and ends; the last one ends before a carriage return."""
    before = np.int64(first_marks[row]) + field - 1
    if field:
        both = word_at(marks, 4 * before)
        start, stop = np.int64(both & _FOUR_BYTES) + 1, np.int64(both >> _U(32))
    else:
        start, stop = np.int64(starts[row]), np.int64(word_at(marks, 4 * before + 4) & _FOUR_BYTES)
    if field == last and word_at(text, stop - 1) & _BYTE == _U(_RETURN):
        stop -= 1
    return start, stop


@lean_kernel
def _float_column(text, field, last, count, starts, first_marks, marks, column, left, short, values, taken_apart):
    """Read a column of floats in the way that is sooner done, going by its first and its last row."""
    if count == 0:
        return
    start, stop = _ends_of(text, field, last, 0, starts, first_marks, marks)
    last_start, last_stop = _ends_of(text, field, last, count - 1, starts, first_marks, marks)
    alike = is_the_same(text, start, stop, last_start, last_stop)
    if alike or may_be_kept(text, start, stop, short) or may_be_kept(text, last_start, last_stop, short):
        _alike_floats(text, field, last, count, starts, first_marks, marks, column, left, short, values)
    else:
        _unlike_floats(text, field, last, count, starts, first_marks, marks, column, left, taken_apart)


@inner_kernel
def _alike_floats(text, field, last, count, starts, first_marks, marks, column, left, short, values):
    """Read a column in which the same few numbers come again and again: each is looked up first."""
    value, sure, start_before, stop_before = 0.0, False, 0, 0
    for row in range(count):
        start, stop = _ends_of(text, field, last, row, starts, first_marks, marks)
        if 0 < stop - start <= 8:
            column[row], is_number = short_float(text, start, stop, short, values)
            left[row] |= not is_number
            continue
        if not (sure and is_the_same(text, start, stop, start_before, stop_before)):  # such as the track's length
            value, sure = float_between(text, start, stop)
            start_before, stop_before = start, stop
        column[row] = value
        left[row] |= not sure


@inner_kernel
def _unlike_floats(text, field, last, count, starts, first_marks, marks, column, left, taken_apart):
    """Read a column of ever other numbers: one act at a time for all of them, which a processor overlaps better."""
    begins, ends, digits, tens = taken_apart
    for row in range(count):
        begins[row], ends[row] = _ends_of(text, field, last, row, starts, first_marks, marks)
    for row in range(count):
        digits[row], tens[row], is_number = digits_between(text, begins[row], ends[row])
        left[row] |= not is_number
    divide(digits[:count], tens, column, left)


@lean_kernel
def _check_column(text, field, last, count, starts, first_marks, marks, left):
    for row in range(count):
        start, stop = _ends_of(text, field, last, row, starts, first_marks, marks)
        left[row] |= not is_plain_float(text, start, stop)


@lean_kernel
def _whole_column(text, field, last, count, starts, first_marks, marks, column, left, may_be_two):
    for row in range(count):
        start, stop = _ends_of(text, field, last, row, starts, first_marks, marks)
        column[row], sure = whole_between(text, start, stop)
        if not sure and may_be_two:
            column[row], behind, sure = _action_at(text, start)
            sure = sure and behind == stop
        left[row] |= not sure


@lean_kernel
def _flag_column(text, field, last, count, starts, first_marks, marks, column, left):
    for row in range(count):
        start, stop = _ends_of(text, field, last, row, starts, first_marks, marks)
        word = word_at(text, start)
        true = (word & _FOUR_BYTES == _TRUE) & (stop - start == 4)
        false = (word & _FIVE_BYTES == _FALSE) & (stop - start == 5)
        column[row] = true
        left[row] |= not (true | false)


@lean_kernel
def _status_column(text, field, last, count, starts, first_marks, marks, statuses, column, left):
    usual = np.uint8(0)
    for row in range(count):
        start, stop = _ends_of(text, field, last, row, starts, first_marks, marks)
        column[row], behind = _status_at(text, start, statuses, usual)
        usual = column[row]
        left[row] |= behind != stop


@kernel
def _close_ranks(left, place, floats, wholes, flags, status, lines):
    """Move rows behind `place` up to where others were left out; return how many stay."""
    to = place
    for row in range(len(left)):
        if not left[row]:
            here = place + row
            for column in floats:
                column[to] = column[here]
            for column in wholes:
                column[to] = column[here]
            for column in flags:
                column[to] = column[here]
            status[to], lines[to] = status[here], lines[here]
            to += 1
    return to - place


@kernel
def _read_row(text, at, length, row, kinds, statuses, floats, wholes, flags, status):
    """Read one row into the columns; return where the next line begins, or -1 where the row is not plainly sound."""
    float_count = whole_count = flag_count = 0
    last = len(kinds) - 1
    for field in range(len(kinds)):
        kind = kinds[field]
        sure = True
        if kind == FLOAT:
            floats[float_count, row], at, sure = _low_decimal_at(text, at)
            float_count += 1
        elif kind == CHECKED:
            _, at, sure = _low_decimal_at(text, at)
        elif kind == WHOLE:
            wholes[whole_count, row], at, sure = _whole_number_at(text, at)
            whole_count += 1
        elif kind == FLAG:
            flags[flag_count, row], at, sure = _flag_at(text, at)
            flag_count += 1
        elif kind == STATUS:
            status[row], at = _status_at(text, at, statuses, status[row - 1] if row else np.uint8(0))
            sure = at >= 0
        elif kind == ACTION:
            wholes[whole_count, row], at, sure = _action_at(text, at)
            whole_count += 1
        else:
            at = _end_of_field(text, at)
        if not sure:
            return -1
        if field < last:
            if np.int64(word_at(text, at) & _BYTE) != _COMMA:
                return -1
            at += 1
    return _end_of_row(text, at, length)


@kernel
def _low_decimal_at(text, at):
    """Read a number as `decimal_at` does; one that no drive has is not sure."""
    value, at, sure = decimal_at(text, at)
    return value, at, sure and abs(value) < HIGHEST


@kernel
def _flag_at(text, at):
    if word_at(text, at) & _FOUR_BYTES == _TRUE:
        return True, at + 4, True
    return False, at + 5, word_at(text, at) & _FIVE_BYTES == _FALSE


@kernel
def _whole_number_at(text, at):
    """Return a whole number, such as 7 or 7.0, the byte behind it, and whether it is sure."""
    count, digits = digits_at(text, at)
    if 0 < count < 8 and np.int64(word_at(text, at + count) & _BYTE) == _COMMA:
        return np.int32(digits), at + count, True
    value, at, sure = decimal_at(text, at)
    sure = sure and abs(value) < HIGHEST_WHOLE and value == np.floor(value)
    return np.int32(np.int64(value) if sure else 0), at, sure


@kernel
def _action_at(text, at):
    """Return a whole number, or -1 for [an angle and a speed]; the byte behind; whether it is sure."""
    if np.int64(word_at(text, at) & _BYTE) != _OPENS:
        return _whole_number_at(text, at)
    at = _end_of_field(text, at)
    return np.int32(-1), at, np.int64(word_at(text, at - 1) & _BYTE) == _CLOSES


@kernel
def _status_at(text, at, statuses, usual):
    """Return the number of a word of the list, tried from `usual` on, and the byte behind it, or -1 if it is none."""
    first, second = word_at(text, at), word_at(text, at + 8)
    for turn in range(len(statuses)):
        number = (usual + turn) % len(statuses)
        length = np.int64(statuses[number, 2])
        if _head(first, length) == statuses[number, 0] and _head(second, length - 8) == statuses[number, 1]:
            return np.uint8(number), at + length
    return np.uint8(0), -1


@kernel
def _head(word, length):
    """Return the first bytes of a word, zeros behind."""
    if length >= 8:
        return word
    return word & ((_U(1) << _U(8 * length)) - _U(1)) if length > 0 else _0


@kernel
def _end_of_field(text, at):
    """Return where the next comma, tab, end of line or zero stands."""
    while True:
        byte = np.int64(word_at(text, at) & _BYTE)
        if byte == _COMMA or (byte <= _RETURN and (byte in (_NEW_LINE, _RETURN, _TAB, 0))):
            return at
        at += 1


@kernel
def _end_of_row(text, at, length):
    """Return where the next line begins if the row ends here, else -1."""
    byte = np.int64(word_at(text, at) & _BYTE)
    if byte == _TAB:
        return _next_line(text, at, length)
    if byte == _RETURN:
        at += 1
        byte = np.int64(word_at(text, at) & _BYTE)
    if byte == _NEW_LINE:
        return at + 1
    return at if at == length else -1


@kernel
def _next_line(text, at, length):
    """Return where the next line begins."""
    while at < length:
        bits = word_at(text, at) ^ _NEW_LINES
        found = (bits - _LOW_BITS) & ~bits & _HIGH_BITS
        if found != _0:
            return min(at + (trailing_zeros(found) >> 3) + 1, length)
        at += 8
    return length


@kernel
def _behind_mark(text, at, length):
    """Return the byte behind the mark SIM_TRACE_LOG: on this line, or -1 where there is none."""
    while at < length:
        bits = word_at(text, at)
        marks, lines = bits ^ _MARK_BEGINS, bits ^ _NEW_LINES
        found = ((marks - _LOW_BITS) & ~marks | (lines - _LOW_BITS) & ~lines) & _HIGH_BITS
        if found == _0:
            at += 8
            continue
        at += trailing_zeros(found) >> 3
        if word_at(text, at) & _BYTE == _U(_NEW_LINE):
            return -1
        if word_at(text, at) == _MARK and word_at(text, at + 6) == _REST_OF_MARK:
            return at + MARK_LENGTH
        at += 1
    return -1

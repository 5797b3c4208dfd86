"""The compiled reader of rows: each number right or left to another, rows and damage as the careful one has them."""

import itertools
import math
import random
import struct
from fractions import Fraction

import numpy as np
import polars as pl
import pytest
from tests.worlds.deepracer.logs import makers

from racecraft.kernels import kernel
from racecraft.worlds.deepracer.files.simulation_log import trace_lines
from racecraft.worlds.deepracer.logs import compiled_rows, read, rows_of_text, stretches
from racecraft.worlds.deepracer.logs.kernels import rows
from racecraft.worlds.deepracer.logs.kernels.decimals import decimal_at
from racecraft.worlds.deepracer.logs.kernels.fields import (
    digits_between,
    divide,
    find_marks,
    float_between,
    is_plain_float,
    no_numbers_yet,
    short_float,
    whole_between,
)
from racecraft.worlds.deepracer.logs.limits import HIGHEST

SPOILT = (
    "",
    "half",
    "7,8,9",
    "nan",
    " 5",
    "True",
    "-",
    "[1.0 2.0",
    "1e999",
    "5.5.5",
    "\0",
    "off track",
    "12345678901",
    "1e14",
    "1e15",
    "-1e308",
    "999999999999999.5",
    "1000000000000000.5",
    "9999999",
    "10000000",
    "TRUE",
)
"""What may stand where a value should; some of it is none, some is one that another reader would take."""


def text_of(letters):
    text = np.zeros(len(letters) + rows.ZEROS_BEHIND, np.uint8)
    text[: len(letters)] = np.frombuffer(letters.encode(), np.uint8)
    return text


def numbers():
    draw = random.Random(7)
    for _ in range(3000):
        value = draw.uniform(-200, 200)
        yield repr(value)
        yield f"{value:.4f}"
        yield repr(value * 10.0 ** draw.randint(-30, 3))
        yield f"{draw.randint(0, 10**19)}.{draw.randint(0, 10 ** draw.randint(1, 18))}"
        yield f"0.{'0' * draw.randint(0, 9)}{draw.randint(1, 10**17)}"
    yield from (
        "0",
        "-0.0",
        "7",
        "9007199254740993",
        "9007199254740992.5",
        "1e22",
        "1E+05",
        "2.5e-07",
        "1e-320",
        "4e400",
    )
    yield from ("0.500000000000000166533453693773481063544750213623046875", "123456789012345678901234567890", "8.5e-58")
    yield from ("1e-320", "4e400")


def test_a_number_is_read_to_the_last_bit_or_left_to_another():
    unsure = wrong = 0
    for letters in numbers():
        text = text_of(f"{letters},")
        value, behind, sure = decimal_at(text.ctypes.data, 0)
        assert behind == len(letters)
        unsure += not sure
        wrong += bool(sure) and struct.pack("d", value) != struct.pack("d", float(letters))
    assert wrong == 0
    assert unsure < 3000  # those of more than nineteen digits


def test_numbers_as_python_prints_them_are_never_left_to_another():
    draw = random.Random(8)
    for value in (draw.uniform(-200, 200) for _ in range(2000)):
        text = text_of(f"{value!r},")
        assert decimal_at(text.ctypes.data, 0) == (value, len(repr(value)), True)


@pytest.mark.parametrize("letters", ["", ",", "-", "nan", "inf", ".", "x1"])
def test_what_is_no_number_is_never_sure(letters):
    assert not decimal_at(text_of(f"{letters},").ctypes.data, 0)[2]


@kernel
def field_as_float(data, start, stop):
    return float_between(data.ctypes.data, start, stop)


@kernel
def field_as_whole(data, start, stop):
    return whole_between(data.ctypes.data, start, stop)


def between_others(letters, around):
    """Return a text in which a field stands among others, and where it begins and ends."""
    text = f"{around * 50},{letters},{around * 80}".encode()
    return np.frombuffer(text, np.uint8).copy(), 50 * len(around) + 1, 50 * len(around) + 1 + len(letters)


@pytest.mark.parametrize("around", ["9", ".", "-"])
def test_a_field_is_read_to_the_last_bit_or_left_to_another_whatever_stands_around_it(around):
    unsure = wrong = 0
    for letters in numbers():
        value, sure = field_as_float(*between_others(letters, around))
        unsure += not sure
        wrong += bool(sure) and struct.pack("d", value) != struct.pack("d", float(letters))
    assert wrong == 0
    assert unsure < 6500  # those of more than nineteen digits, and those with an exponent


def test_fields_as_python_prints_them_are_never_left_to_another():
    draw = random.Random(9)
    values = [draw.uniform(-200, 200) * 10.0 ** draw.randint(-2, 0) for _ in range(2000)]
    for letters in [repr(value) for value in values if abs(value) > 1e-4] + ["0.0", "-0.0", "1772822039.5168517", "7"]:
        value, sure = field_as_float(*between_others(letters, "9"))
        assert sure, letters
        assert struct.pack("d", value) == struct.pack("d", float(letters))


@pytest.mark.parametrize("letters", ["", "-", "nan", ".", "x1", "1.2.3", "12345678.1.2", "1.0 ", " 5", "1e3", "1" * 40])
def test_a_field_that_is_no_plain_number_is_never_sure(letters):
    assert not field_as_float(*between_others(letters, "9"))[1]


@kernel
def floats_apart(data, starts, stops, tens, quotients, left):
    digits = np.empty(len(starts), np.uint64)
    for row in range(len(starts)):
        digits[row], tens[row], is_number = digits_between(data.ctypes.data, starts[row], stops[row])
        left[row] |= not is_number
    divide(digits, tens, quotients, left)


def many_fields(letters):
    """Return what a column of fields is read as, and which of them are left to another."""
    text = np.frombuffer(("9" * 50 + ",".join(["", *letters, ""]) + "9" * 80).encode(), np.uint8)
    stops = 50 + np.cumsum([1 + len(one) for one in letters])
    quotients, left = np.empty(len(letters)), np.zeros(len(letters), np.bool_)
    floats_apart(text, stops - [len(one) for one in letters], stops, np.empty(len(letters)), quotients, left)
    return quotients, left


def test_a_column_is_read_to_the_last_bit_or_left_to_another():
    letters = list(numbers())
    values, left = many_fields(letters)
    wrong = [
        one
        for one, value, is_left in zip(letters, values, left, strict=True)
        if not is_left and struct.pack("d", value) != struct.pack("d", float(one))
    ]
    assert not wrong
    assert left.sum() < 6500  # those of more than nineteen digits, and those with an exponent


def test_a_column_as_python_prints_it_is_never_left_to_another():
    draw = random.Random(9)
    values = [draw.uniform(-200, 200) * 10.0 ** draw.randint(-2, 0) for _ in range(2000)]
    letters = [repr(value) for value in values if abs(value) > 1e-4] + ["0.0", "-0.0", "1772822039.5168517", "7"]
    read_as, left = many_fields(letters)
    assert not left.any()
    assert [struct.pack("d", value) for value in read_as] == [struct.pack("d", float(one)) for one in letters]


def decimal(digits, places):
    """Return so many digits as a number with so many places."""
    letters = str(digits).zfill(places + 1)
    return f"{letters[: len(letters) - places]}.{letters[len(letters) - places :]}"


def near_middles():
    """Yield decimals as near as they come to the middle between two floats: on both sides, and the nearest of all.

    The nearest are found as convergents: w / 10^p is all but m / 2^a where w / m is all but 10^p / 2^a.
    """
    draw = random.Random(6)
    for _ in range(2000):
        value, places = 10.0 ** draw.uniform(-3, 3) * draw.uniform(1, 10), draw.randint(12, 15)
        middle = (Fraction(value) + Fraction(np.nextafter(value, np.inf))) / 2
        yield decimal(math.floor(middle * 10**places), places)
        yield decimal(math.floor(middle * 10**places) + 1, places)
    for places, halvings in itertools.product(range(4, 23), range(8, 80)):
        whole, part = 10**places, 1 << halvings
        (before, below), (now, here) = (0, 1), (1, 0)
        while part and here < 1 << 54:
            step = whole // part
            (before, below), (now, here) = (now, here), (now * step + before, here * step + below)
            whole, part = part, whole - step * part
            odd = ((1 << 53) // here | 1) if here else 0
            if here % 2 and (here * odd).bit_length() == 54 and now * odd < 1 << 62:
                yield decimal(now * odd, places)


def test_just_beside_the_middle_between_two_floats_a_quotient_is_right_or_not_sure():
    letters = [one for one in near_middles() if float(one) < HIGHEST]
    values, left = many_fields(letters)
    assert not [
        one for one, value, is_left in zip(letters, values, left, strict=True) if not is_left and value != float(one)
    ]
    assert 0 < left.sum() < 0.1 * len(letters)


@pytest.mark.parametrize(
    ("letters", "is_left"),
    [
        ("0.0000000000000000000001", False),
        ("0.00000000000000000000001", True),
        ("0.4611686018427387903", False),
        ("0.4611686018427387904", True),
        ("999999999999999.5", False),
        ("1000000000000000.5", True),
        ("-1000000000000000.5", True),
        ("-12.5", False),
        ("", True),
        ("-", True),
        (".", True),
        ("1e3", True),
        ("1" * 40, True),
    ],
)
def test_where_a_column_ends_to_be_sure(letters, is_left):
    """Beyond 22 places, beyond 62 bits, beyond what any drive has, and what is no plain number."""
    assert many_fields(["7.25", letters, "-0.5"])[1].tolist() == [False, is_left, False]


@kernel
def is_plain(data, start, stop):
    return is_plain_float(data.ctypes.data, start, stop)


def test_a_number_that_nobody_asks_for_is_held_to_what_is_read_all_the_same():
    taken = 0
    for letters in [*numbers(), *SPOILT, ".5", "5.", "-.5", "1.", "-5", "00000000000000001.5"]:
        if is_plain(*between_others(letters, "9")):
            taken += 1
            assert set(letters.removeprefix("-")) <= set("0123456789."), letters
            assert abs(float(letters)) < HIGHEST, letters
        else:
            assert not field_as_float(*between_others(letters, "9"))[1] or "0000000" in letters, letters
    assert taken > 5000


@kernel
def short_field(data, start, stop, fields, values):
    return short_float(data.ctypes.data, start, stop, fields, values)


def test_a_short_field_that_was_read_before_is_the_number_it_was():
    """One table for all, far fewer places than fields: none is taken for another, and what is no number never stays."""
    draw = random.Random(4)
    fields, values = (one[0] for one in no_numbers_yet(1))
    letters = [f"{draw.uniform(-30, 30):.{draw.randint(0, 4)}f}"[:8] for _ in range(400)]
    letters += ["0", "-0.0", "0.0", "00", "0000", "\0", "\0" * 8, "nan", "-", "1e3", "1 ", "x", "5", "05", "5\0"]
    draw.shuffle(letters)
    for one in letters * 3:
        around = draw.choice("9.-")
        value, sure = short_field(*between_others(one, around), fields, values)
        expected, is_number = field_as_float(*between_others(one, around))
        assert sure == is_number, one
        assert not sure or struct.pack("d", value) == struct.pack("d", expected) == struct.pack("d", float(one)), one


def test_whole_numbers_fill_their_field_or_are_left_to_another():
    for letters, expected in [("0", 0), ("7.0", 7), ("1234567", 1234567), ("1234567.0", 1234567), ("10.0", 10)]:
        assert field_as_whole(*between_others(letters, "9")) == (expected, True)
    for letters in ("", "-1", "7.5", ".0", "12345678", "1e3", "7.00", "7 ", "x"):
        assert not field_as_whole(*between_others(letters, "9"))[1], letters


def test_commas_and_ends_of_lines_are_found_wherever_they_stand():
    draw = random.Random(4)
    letters = "".join(draw.choices("ab,\n7", [5, 5, 2, 1, 5], k=1000))
    text = text_of(letters)
    for begin, end in ((0, 1000), (0, 64), (3, 3), (5, 200), (63, 129), (100, 999)):
        marks, lines = np.zeros(1001, np.int32), np.zeros(1001, np.int32)
        count, line_count = find_marks(text.ctypes.data, begin, end, marks, lines)
        assert marks[:count].tolist() == [k for k in range(begin, end) if letters[k] in ",\n"]
        assert [letters[marks[k]] for k in lines[:line_count]] == ["\n"] * letters.count("\n", begin, end)


def spoiled_lines(continuous):
    """Return the lines of a trace; every seventh has a value in it that may be none."""
    lines = makers.csv_text(makers.iteration(range(20), continuous=continuous)).rstrip("\n").split("\n")
    draw = random.Random(3)
    for k in range(3, len(lines), 7):
        cells = lines[k].split(",")
        cells[draw.randrange(len(cells))] = draw.choice(SPOILT)
        lines[k] = ",".join(cells)
    lines[30] = lines[30][:40]
    return lines


def both_ways(path, monkeypatch, block_bytes):
    """Return what the careful reader makes of a file, and the compiled one in blocks of so many bytes."""
    for little, block in ((1 << 30, 1 << 22), (0, block_bytes)):
        monkeypatch.setattr(rows_of_text, "LITTLE_BYTES", little)
        monkeypatch.setattr(stretches, "STRETCH_BYTES", block)
        logs = read(path)
        yield logs.ticks.collect(), logs.damaged, logs.about


@pytest.mark.parametrize("block_bytes", [300, 1000, 1 << 22])
@pytest.mark.parametrize("continuous", [False, True])
@pytest.mark.parametrize("end", ["\n", "\r\n", ""])
def test_a_damaged_trace_is_the_same_either_way(tmp_path, monkeypatch, block_bytes, continuous, end):
    path = tmp_path / "0-iteration.csv"
    lines = spoiled_lines(continuous)
    path.write_bytes(((end or "\n").join(lines) + end).encode())
    (careful, damage, _), (compiled, compiled_damage, _) = both_ways(path, monkeypatch, block_bytes)
    assert compiled.equals(careful)
    assert compiled_damage == damage
    assert damage
    assert careful.height > 150


@pytest.mark.parametrize("block_bytes", [300, 1000, 1 << 22])
def test_a_log_among_other_lines_is_the_same_either_way(tmp_path, monkeypatch, block_bytes):
    path = tmp_path / "training-sim-1.log"
    written = trace_lines(makers.iteration(range(6)))
    written[5] = written[5].replace("in_progress", "in progress")
    written[9] += "\tand what somebody else wrote"
    lines = [" * /WORLD_NAME: reinvent_base", "SIM_TRACE_LO", "S", ""]
    for k, line in enumerate(written):
        lines += [f"[node-1] [agent-9] {line}", *(["Saving Score S\ttext"] if k % 3 == 0 else [])]
    lines.append(
        "Training> Name=main_level/agent, Worker=0, Episode=1, Total reward=3.2, Steps=5, Training iteration=0"
    )
    path.write_text("\n".join(lines))
    (careful, damage, said), (compiled, compiled_damage, compiled_said) = both_ways(path, monkeypatch, block_bytes)
    assert compiled.equals(careful)
    assert (compiled_damage, compiled_said) == (damage, said)
    assert [one.line for one in damage] == [next(k for k, line in enumerate(lines, 1) if "in progress" in line)]
    assert (said["world"], careful.height) == ("reinvent_base", len(written) - 1)


@pytest.mark.parametrize("spare", [0.01, 0.5, 2.0])
def test_several_files_keep_their_places(tmp_path, monkeypatch, spare):
    """Also where the table was made too small for those that follow."""
    monkeypatch.setattr(compiled_rows, "SPARE", spare)
    for k in range(4):
        makers.write(tmp_path / "training-simtrace" / f"{k}-iteration.csv", makers.iteration(range(3 * k, 3 * k + 3)))
    (careful, _, _), (compiled, _, _) = both_ways(tmp_path, monkeypatch, 500)
    assert compiled.equals(careful)
    assert compiled["file"].unique(maintain_order=True).to_list() == [0, 1, 2, 3]
    assert (compiled.group_by("file").agg(pl.col("line").min())["line"] == 2).all()


def test_damage_in_many_files_that_are_read_at_once_is_told_of_the_right_one(tmp_path, monkeypatch):
    for k in range(5):
        lines = makers.csv_text(makers.iteration(range(3 * k, 3 * k + 3))).rstrip("\n").split("\n")
        for spoilt in (1, k + 2, -1):
            lines[spoilt] = lines[spoilt].replace("True", "Treu").replace("False", "Flase")
        path = tmp_path / "training-simtrace" / f"{k}-iteration.csv"
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join(lines) + ("\n" if k % 2 else ""))
    (careful, damage, _), (compiled, compiled_damage, _) = both_ways(tmp_path, monkeypatch, 1 << 22)
    assert compiled.equals(careful)
    assert compiled_damage == damage
    assert [one.line for one in damage[:2]] == [2, 3]
    assert len(damage) == 15


def test_a_file_that_fails_meanwhile_does_not_keep_the_others_waiting(tmp_path, monkeypatch):
    """Stretches get their places by turns; one that cannot be loaded has its turn too."""
    for k in range(4):
        makers.write(tmp_path / "training-simtrace" / f"{k}-iteration.csv", makers.iteration(range(3 * k, 3 * k + 3)))
    load = stretches.Stretch.load

    def taken_away(stretch):
        if stretch.pieces[0].text.place == 1:
            raise OSError(5, "Input/output error")
        return load(stretch)

    monkeypatch.setattr(rows_of_text, "LITTLE_BYTES", 0)
    monkeypatch.setattr(stretches, "STRETCH_BYTES", 500)
    monkeypatch.setattr(stretches.Stretch, "load", taken_away)
    with pytest.raises((OSError, pl.exceptions.ComputeError), match="Input/output"):  # Polars 1 wraps what it caught
        read(tmp_path).ticks.collect()

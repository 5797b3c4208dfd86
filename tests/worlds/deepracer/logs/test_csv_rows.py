"""Rows parsed by Polars: numbers right to the last bit; rows and damage as the tolerant reader has them."""

import random
import subprocess
import sys

import pytest
from tests.worlds.deepracer.logs import makers

from racecraft.worlds.deepracer.files.simulation_log import trace_lines
from racecraft.worlds.deepracer.logs import csv_rows, read
from racecraft.worlds.deepracer.logs.limits import HIGHEST

SPOILT = (
    "", "half", "7,8,9", "nan", " 5", "True", "-", "[1.0 2.0", "1e999", "5.5.5", "\0", "off track", "12345678901",
    "1e14", "1e15", "-1e308", "999999999999999.5", "1000000000000000.5", "9999999", "10000000", "TRUE", "7,,", "\r",
    "[1.0 2.0]", "+5",
)  # fmt: skip
"""What may stand where a value should; some of it is none, some is one that another reader would take."""


def numbers():
    draw = random.Random(7)
    for _ in range(3000):
        value = draw.uniform(-200, 200)
        yield repr(value)
        yield f"{value:.4f}"
        yield repr(value * 10.0 ** draw.randint(-30, 3))
        yield f"{draw.randint(0, 10**19)}.{draw.randint(0, 10 ** draw.randint(1, 18))}"
        yield f"0.{'0' * draw.randint(0, 9)}{draw.randint(1, 10**17)}"
    yield from ("0", "-0.0", "7", "9007199254740993", "9007199254740992.5", "1e22", "1E+05", "2.5e-07", "1e-320")
    yield from ("0.500000000000000166533453693773481063544750213623046875", "123456789012345678901234567890", "8.5e-58")


def test_a_number_is_read_to_the_last_bit(tmp_path):
    head, *rows = makers.csv_text(makers.iteration(range(3))).splitlines()
    texts = [*{float(text): text for text in numbers() if abs(float(text)) < HIGHEST}.values()]
    cells = rows[3].split(",")
    place = head.split(",").index("reward")
    (tmp_path / "0-iteration.csv").write_text(
        "\n".join([head, *(",".join([*cells[:place], text, *cells[place + 1 :]]) for text in texts)]) + "\n"
    )
    # A process of its own: a training takes numbers next to nothing for zero, in every thread begun after it.
    read_rewards = (
        "import sys; from racecraft.worlds.deepracer.logs import read;"
        "print(*map(float.hex, read(sys.argv[1]).ticks.collect()['reward']))"
    )
    printed = subprocess.run(
        [sys.executable, "-c", read_rewards, str(tmp_path)], capture_output=True, text=True, check=True
    ).stdout
    assert printed.split() == [float(text).hex() for text in texts]


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


def both_ways(path, monkeypatch, chunk_bytes):
    """Return what the tolerant reader alone makes of a file, and what both make of it in chunks of so many bytes."""
    with monkeypatch.context() as patched:
        patched.setattr(csv_rows, "_has_hidden_cells", lambda *_: True)
        tolerant = read(path)
        yield tolerant.ticks.collect(), tolerant.damaged, tolerant.about
    with monkeypatch.context() as patched:
        patched.setattr(csv_rows, "CHUNK_BYTES", chunk_bytes)
        logs = read(path)
        yield logs.ticks.collect(), logs.damaged, logs.about


@pytest.mark.parametrize("chunk_bytes", [300, 1 << 22])
@pytest.mark.parametrize("continuous", [False, True])
@pytest.mark.parametrize("end", ["\r\n", ""])
def test_a_damaged_trace_is_the_same_either_way(tmp_path, monkeypatch, chunk_bytes, continuous, end):
    path = tmp_path / "0-iteration.csv"
    lines = spoiled_lines(continuous)
    path.write_bytes(((end or "\n").join(lines) + end).encode())
    (tolerant, damage, _), (both, both_damage, _) = both_ways(path, monkeypatch, chunk_bytes)
    assert both.equals(tolerant)
    assert both_damage == damage
    assert damage
    assert tolerant.height > 150


@pytest.mark.parametrize("behind", [",", ",,7"])
def test_a_row_with_cells_behind_the_last_column_is_damaged(tmp_path, behind):
    lines = makers.csv_text(makers.iteration(range(2))).splitlines()
    lines[4] += behind
    path = tmp_path / "0-iteration.csv"
    path.write_text("\n".join(lines) + "\n")
    logs = read(path)
    assert [one.line for one in logs.damaged] == [5]
    assert logs.ticks.collect().height == 23


@pytest.mark.parametrize("blank", ["", "\r"])
def test_blank_lines_move_no_line_number(tmp_path, blank):
    lines = makers.csv_text(makers.iteration(range(1))).splitlines()
    path = tmp_path / "0-iteration.csv"
    path.write_text("\n".join([*lines[:3], blank, *lines[3:], blank, blank]) + "\n")
    logs = read(path)
    assert logs.ticks.collect()["line"].to_list() == [2, 3, *range(5, 15)]
    assert logs.damaged == ()


def test_a_log_among_other_lines_is_the_same_either_way(tmp_path, monkeypatch):
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
    (tolerant, damage, said), (both, both_damage, both_said) = both_ways(path, monkeypatch, 300)
    assert both.equals(tolerant)
    assert (both_damage, both_said) == (damage, said)
    assert [one.line for one in damage] == [next(k for k, line in enumerate(lines, 1) if "in progress" in line)]
    assert (said["world"], tolerant.height) == ("reinvent_base", len(written) - 1)


def test_damage_in_many_files_that_are_read_at_once_is_told_of_the_right_one(tmp_path, monkeypatch):
    for k in range(5):
        lines = makers.csv_text(makers.iteration(range(3 * k, 3 * k + 3))).rstrip("\n").split("\n")
        for spoilt in (1, k + 2, -1):
            lines[spoilt] = lines[spoilt].replace("True", "Treu").replace("False", "Flase")
        path = tmp_path / "training-simtrace" / f"{k}-iteration.csv"
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join(lines) + ("\n" if k % 2 else ""))
    (tolerant, damage, _), (both, both_damage, _) = both_ways(tmp_path, monkeypatch, 1 << 22)
    assert both.equals(tolerant)
    assert both_damage == damage
    assert [one.line for one in damage[:2]] == [2, 3]
    assert len(damage) == 15

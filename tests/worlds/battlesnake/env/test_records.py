"""By twin: the official engine's recorded games, and what a spoilt record brings to light."""

import copy
import gzip
import json
import random
from collections import Counter
from itertools import islice

import pytest
from tests.reference import DATA

from racecraft.contract.errors import InputFileError, UserInputError
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.records import read_games
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.verify import verify_records

RECORDS = DATA / "battlesnake"
FILES = {"official_engine_trajectories.jsonl.gz": (40, 2624), "official_engine_trajectories_more.jsonl.gz": (29, 4256)}


def first_lines(name, count):
    with gzip.open(RECORDS / name, "rt") as file:
        return [json.loads(line) for line in islice(file, count)]


@pytest.mark.parametrize("name", FILES)
def test_referee_and_kernel_agree_with_every_recorded_game(name):
    report = verify_records(RECORDS / name)
    assert (report.games, report.steps) == FILES[name]
    assert report.mismatches == 0, "\n".join(report.examples)


SPOILT = {
    "health": lambda step: step["snakes"][0].update(health=step["snakes"][0]["health"] - 1),
    "a body": lambda step: step["snakes"][1]["body"].reverse(),
    "food": lambda step: step["food_rules"].append([0, 6]),
    "hazards": lambda step: step["haz_rules"].append([3, 3]),
    "food on a snake": lambda step: step["food"].append(step["snakes"][0]["body"][0]),
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_spoilt_record_is_found_and_drawn(what, tmp_path):
    lines = first_lines("official_engine_trajectories.jsonl.gz", 4)
    SPOILT[what](lines[1])
    spoilt = tmp_path / "spoilt.jsonl"
    spoilt.write_text("\n".join(json.dumps(line) for line in lines))
    report = verify_records(spoilt)
    assert not report.agrees
    assert "turn 0" in report.examples[0]
    assert "recorded:" in report.examples[0]
    assert report.to_dict()["mismatches"] == report.mismatches


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no game in it"),
        ("{}", "KeyError"),
        ("[1]", "expected a JSON object"),
        ("{not json", "JSON"),
        ('{"t": "step"}', "before any game"),
        ('{"t": "game", "w": 7}', "KeyError"),
    ],
)
def test_a_file_that_is_no_record_is_refused_by_line(text, message, tmp_path):
    path = tmp_path / "record.jsonl"
    path.write_text(text)
    with pytest.raises(InputFileError, match=message):
        verify_records(path)


SNAKE = {"id": "a", "body": [[1, 1], [1, 0]], "health": 90, "cause": "", "by": "", "on": 0}
GAME = {
    "t": "game", "w": 7, "h": 9, "ruleset": "royale", "map": "hz_rings", "damage": 20, "shrink": 5, "chance": 33,
    "min": 2, "solo": True, "snakes": [SNAKE], "food": [[2, 2]], "hazards": [[0, 0], [0, 0]],
}  # fmt: skip
STEP = {
    "t": "step", "turn": 0, "moves": {"a": "up"}, "food_pre": [[3, 3]], "haz_pre": [], "snakes": [SNAKE],
    "food_rules": [[4, 4]], "haz_rules": [[5, 5]], "food": [], "hazards": [[6, 6]],
}  # fmt: skip


def read(tmp_path, *lines):
    path = tmp_path / "record.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return list(read_games(path))


def test_what_a_record_says_is_what_is_read(tmp_path):
    changed = {**SNAKE, "health": 33}
    steps = [STEP, {**STEP, "turn": 1, "snakes_post": [changed]}, {**STEP, "turn": 2}]
    first, second = read(tmp_path, GAME, *steps, {"t": "over", "turn": 3}, GAME)
    settings = GameSettings(7, 9, 1, "royale", "hz_rings", 33, 2, 20, 5, solo=True)
    assert (first.line, first.settings, first.over_turn) == (1, settings, 3)
    assert (second.line, second.steps, second.over_turn) == (6, [], None)
    snake = Snake("a", [(1, 1), (1, 0)], 90)
    assert first.start == Board(7, 9, 0, [snake], [(2, 2)], Counter({(0, 0): 2}))
    step = first.steps[0]
    assert step.moves == {"a": "up"}
    assert step.before == Board(7, 9, 0, [snake], [(3, 3)])
    assert step.after_rules == Board(7, 9, 0, [snake], [(4, 4)], Counter([(5, 5)]))
    assert step.after_map == Board(7, 9, 1, [snake], [], Counter([(6, 6)]))
    told = [(one.before.turn, one.before.snakes[0].health, one.after_map.snakes[0].health) for one in first.steps]
    assert told == [(0, 90, 90), (1, 90, 33), (2, 33, 90)], "the map changed a snake after the second turn"


def spoil(value, rng):
    """Change one thing somewhere inside a JSON value."""
    if isinstance(value, dict) and value:
        key = rng.choice(sorted(value))
        if rng.random() < 0.1:
            del value[key]
        else:
            value[key] = spoil(value[key], rng)
        return value
    if isinstance(value, list) and value:
        place = rng.randrange(len(value))
        value[place] = spoil(value[place], rng)
        return value
    return rng.choice([None, -1, 10**9, "x", [], {}, 3.5, True, [[0, 0]], [[99, -5]]])


def test_spoilt_records_end_in_a_report_or_a_letter(tmp_path):
    lines, rng = first_lines("official_engine_trajectories.jsonl.gz", 5), random.Random(1)
    outcomes = set()
    for number in range(250):
        spoilt = copy.deepcopy(lines)
        spoil(spoilt[rng.randrange(len(spoilt))], rng)
        path = tmp_path / f"{number}.jsonl"
        path.write_text("\n".join(map(json.dumps, spoilt)))
        try:
            outcomes.add(verify_records(path).agrees)
        except UserInputError:
            outcomes.add("letter")
    assert {False, "letter"} <= outcomes


def test_a_cut_archive_is_refused(tmp_path):
    path = tmp_path / "record.jsonl.gz"
    path.write_bytes(gzip.compress(b'{"t": "game"}' * 50)[:20])
    with pytest.raises(InputFileError, match="gzip|Compressed|end-of-stream"):
        verify_records(path)

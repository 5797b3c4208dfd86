"""By twin: the official engine's recorded games, and what a spoilt record brings to light."""

import copy
import gzip
import json
import random

import pytest
from tests.reference import DATA

from racecraft.contract.errors import InputFileError, UserInputError
from racecraft.envs.battlesnake.verify import verify_records

RECORDS = DATA / "battlesnake"
FILES = {"official_engine_trajectories.jsonl.gz": (40, 2624), "official_engine_trajectories_more.jsonl.gz": (29, 4256)}


def lines_of(name):
    with gzip.open(RECORDS / name, "rt") as file:
        return [json.loads(line) for line in file]


@pytest.mark.parametrize("name", FILES)
def test_referee_and_kernel_agree_with_every_recorded_game(name):
    lines_of(name)
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
    lines = lines_of("official_engine_trajectories.jsonl.gz")[:4]
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
    lines, rng = lines_of("official_engine_trajectories.jsonl.gz")[:5], random.Random(1)
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

"""The file of a tournament: its lines letter by letter, and every line that is refused with what is wrong in it."""

import json
from dataclasses import asdict

import pytest

from racecraft.contract.errors import InputFileError
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.standings import GameResult
from racecraft.worlds.battlesnake.evaluation.tournament_file import TournamentFile

SMALL = GameSettings(7, 7, 2)
ASKED = (["a", "b", "c"], SMALL, 100, 4, 1000)
GAME = GameResult(1, (2, 0), (0, 1), 87, (0, 3), (1, 0))
LINE = '{"number":1,"players":[2,0],"places":[0,1],"turns":87,"timeouts":[0,3],"crashes":[1,0]}'


def test_lines_are_dense_json_and_a_game_comes_back_as_it_was(tmp_path):
    path = tmp_path / "games.jsonl"
    kept = TournamentFile(path, *ASKED)
    assert kept.games == []
    kept.add(GAME)
    head, line = path.read_text().splitlines()
    assert json.loads(head) == {
        "tournament": 1, "players": ["a", "b", "c"], "game": asdict(SMALL), "timeout_ms": 100, "seed": 4,
        "most_turns": 1000,
    }  # fmt: skip
    assert ": " not in head
    assert line == LINE
    again = TournamentFile(str(path), *ASKED)
    assert again.games == [GAME]
    again.add(GameResult(2, (0, 1, 2), (0, 0, 2), 5, (0,) * 3, (0,) * 3))
    assert len(path.read_text().splitlines()) == 3
    assert [game.number for game in TournamentFile(path, *ASKED).games] == [1, 2]


def test_a_line_that_was_cut_is_written_anew(tmp_path):
    path = tmp_path / "games.jsonl"
    TournamentFile(path, *ASKED).add(GAME)
    whole = path.read_bytes()
    path.write_bytes(whole + b'{"number":2,"pla')
    kept = TournamentFile(path, *ASKED)
    assert kept.games == [GAME]
    kept.add(GameResult(2, (2, 0), (0, 1), 87, (0, 3), (1, 0)))
    assert path.read_bytes() == whole + LINE.replace('"number":1', '"number":2').encode() + b"\n"


def line(**changes):
    return json.dumps(json.loads(LINE) | changes)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (line(number=2), "game 2 where game 1 belongs"),
        (line(places=[0]), "game 1 where game 1 belongs"),
        (line(timeouts=[0, 0.5]), r"timeouts \[0, 0.5\]"),
        (line(players=[0, 3]), r"players \(0, 3\) of 3"),
        ('{"number": 1}', "KeyError"),
        ("no", "JSONDecodeError"),
    ],
)
def test_a_line_that_can_be_no_game_is_named(tmp_path, text, words):
    path = tmp_path / "games.jsonl"
    TournamentFile(path, *ASKED)
    path.write_text(path.read_text() + text + "\n")
    with pytest.raises(InputFileError, match=rf"games\.jsonl:2: .*{words}"):
        TournamentFile(path, *ASKED)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ((["a", "b"], SMALL, 100, 4, 1000), "players"),
        ((["a", "b", "c"], SMALL, 100, 5, 1000), "seed 4, now 5"),
    ],
)
def test_another_tournament_is_named_by_what_differs_alone(tmp_path, asked, words):
    path = tmp_path / "games.jsonl"
    TournamentFile(path, *ASKED)
    before = path.read_bytes()
    with pytest.raises(InputFileError, match=rf"another tournament \({words}[^;]*\)"):
        TournamentFile(path, *asked)
    assert path.read_bytes() == before


def test_what_cannot_be_read_or_holds_nothing_is_refused(tmp_path):
    with pytest.raises(InputFileError, match=r"cannot be read \(Is a directory\)"):
        TournamentFile(tmp_path, *ASKED)
    for text in ("", '{"tournament": 1'):
        (tmp_path / "cut.jsonl").write_text(text)
        with pytest.raises(InputFileError, match="no line in it"):
            TournamentFile(tmp_path / "cut.jsonl", *ASKED)

"""`racecraft snakes arena`, as a user types it."""

import json
import os
import signal
import urllib.request
from dataclasses import asdict

import pytest
from tests.forked import Begun

from racecraft.worlds.battlesnake.players.weights import AMONG_SEVERAL

NEW = ("snakes", "arena", "new", "-W", 7, "-H", 7, "--snakes", 2, "--most-turns", 30, "-t", 300)


@pytest.fixture
def arena(racecraft):
    said = racecraft(*NEW, "--anchor", "flood_fill", "--anchor", "hungry", "--json")
    assert said.code == 0, said.err
    assert json.loads(said.out) == {"arena": "arena.sqlite", "anchors": ["flood_fill", "hungry"]}


def test_an_arena_from_its_first_day_to_an_exported_game(racecraft, arena, tmp_path):
    (tmp_path / "mine.py").write_text("def move(data):\n    return 'up'\n")
    said = racecraft("snakes", "arena", "add", "mine.py", "random_safe", "--name", "mine", "--json")
    assert [one["name"] for one in json.loads(said.out)["players"]] == ["mine", "random_safe"]
    said = racecraft("snakes", "arena", "play", "--games", 6, "--json")
    assert said.code == 0, said.err
    assert json.loads(said.out)["played"] == 6
    assert racecraft("snakes", "arena", "remove", "mine").out == "mine is drawn no more; its games stay.\n"
    shown = json.loads(racecraft("snakes", "arena", "show", "mine", "--json").out)
    assert shown["player"]["rests"]
    assert all("mine" in game["players"] for game in shown["latest"])
    table = racecraft("snakes", "arena", "show").out
    assert "6 games" in table
    assert " … " in table
    assert "removed" in table
    assert "anchor" in table
    assert racecraft("snakes", "arena", "add", "mine.py", "--name", "mine").out.startswith("mine is in")
    assert racecraft("snakes", "arena", "export", "game.jsonl", "--game", 2).code == 0
    assert racecraft("snakes", "verify", "game.jsonl").code == 0
    assert json.loads(racecraft("snakes", "arena", "export", "all.jsonl", "--json").out)["games"] == 6
    lines = [json.loads(line) for line in (tmp_path / "all.jsonl").read_text().splitlines()]
    assert [line["game"] for line in lines] == [1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        (("play", "--arena", "none.sqlite"), "there is no arena"),
        (("new", "--anchor", "search", "--arena", "a"), "expected an anchor that never does"),
        (("new",), "something stands there"),
        (("add", "hungry"), "There is a player 'hungry' in this arena already"),
        (("remove", "hungry"), "the scale hangs on it"),
        (("export", "g.jsonl", "--game", 3), "none was played yet"),
    ],
)
def test_bad_input_is_named(racecraft, arena, tmp_path, typed, told):
    said = racecraft("snakes", "arena", *typed)
    assert said.code == 2
    assert told in said.err
    assert not (tmp_path / "a").exists()


@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent as a signal")
def test_ctrl_c_keeps_everything_and_the_board_answers_meanwhile(racecraft, arena, tmp_path):
    with Begun(["snakes", "arena", "play", "--board", "--no-open", "--port", "0"], tmp_path) as process:
        address = ""
        while not (line := process.stderr.readline()).startswith("game 3:"):
            address = line.split()[-1] if line.startswith("The board: ") else address
        with urllib.request.urlopen(address + "api/board", timeout=60) as answer:
            board = json.loads(answer.read())
        assert board["playing"]
        assert board["last_game"] >= 3
        second = racecraft("snakes", "arena", "play", "--games", 1)
        assert second.code == 2
        assert "somebody plays in it already" in second.err
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "goes on from here" in err
    assert "flood_fill" in out
    kept = json.loads(racecraft("snakes", "arena", "show", "--json").out)["games"]
    assert kept >= 3
    assert json.loads(racecraft("snakes", "arena", "play", "--games", 1, "--json").out)["games"] == kept + 1


def test_weights_are_tuned_and_played_by(racecraft, tmp_path):
    small = ("-W", 7, "-H", 7, "--rounds", 1, "--proof", 2, "--effort", 16, "--most-turns", 5)
    tune = ("snakes", "tune", "w.json", *small)
    said = racecraft(*tune, "--json")
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert (told["rounds"], told["proven"]["games"]) == (1, 2)
    assert told["weights"] == json.loads((tmp_path / "w.json").read_text())["weights"]
    played = ("snakes", "play", "-u", "search:w.json", "-u", "hungry", "-W", 7, "-H", 7, "--most-turns", 3, "-t", 500)
    assert racecraft(*played).code == 0
    assert racecraft(*NEW).code == 0
    assert racecraft("snakes", "arena", "add", "search:w.json", "--name", "tuned").code == 0
    (tmp_path / "w.json").write_text("{}")
    for bad in (tune, played):
        said = racecraft(*bad)
        assert said.code == 2
        assert "another kind of file" in said.err
    assert "squares" in racecraft("snakes", "tune", "four.json", *small, "--snakes", 4).out
    began_with = json.loads((tmp_path / "four.json").read_text())["gauntlet"]["start"]
    assert began_with == asdict(AMONG_SEVERAL), "not what serves best in duels"
    assert racecraft("snakes", "tune", "x.json", "--snakes", 3).code == 2
    assert not (tmp_path / "x.json").exists()

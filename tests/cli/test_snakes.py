"""`racecraft snakes`, as a user types it."""

import json
import signal
import urllib.request

import pytest
from tests.forked import Begun, ran
from tests.reference import DATA

RECORDS = DATA / "battlesnake"


def test_a_game_is_played_written_and_drawn(racecraft, tmp_path):
    said = racecraft(
        "snakes", "play", "-u", "flood_fill", "-u", "hungry", "-n", "Flo", "-W", 7, "-H", 7, "-r", 5,
        "-o", "game.jsonl", "--gif", "game.gif", "--json",
    )  # fmt: skip
    assert said.code == 0, said.err
    facts = json.loads(said.out)
    assert {"winnerId", "winnerName", "isDraw", "turns", "seed"} <= set(facts)
    assert [seat["name"] for seat in facts["seats"]] == ["Flo", "hungry"]
    lines = (tmp_path / "game.jsonl").read_text().splitlines()
    assert len(lines) == facts["turns"] + 3
    assert racecraft("snakes", "gif", "game.jsonl", "again.gif").code == 0
    assert (tmp_path / "again.gif").read_bytes() == (tmp_path / "game.gif").read_bytes()
    again = racecraft("snakes", "play", "-u", "flood_fill", "-u", "hungry", "-W", 7, "-H", 7, "-r", 5)
    assert f"Turn {facts['turns']}:" in again.out
    named = racecraft("snakes", "play", "flood_fill", "-u", "hungry", "-n", "Flo", "-W", 7, "-H", 7, "-r", 5, "--json")
    assert json.loads(named.out) == {key: facts[key] for key in json.loads(named.out)}


def test_a_game_is_watched_in_the_terminal(racecraft):
    said = racecraft(
        "snakes", "play", "-u", "hungry", "-g", "solo", "-W", 7, "-H", 7, "-r", 1, "-v", "-D", 1, "--most-turns", 3
    )
    assert said.code == 0, said.err
    assert "turn 3" in said.out


def test_a_tournament_says_who_is_strong(racecraft):
    said = racecraft("snakes", "tournament", "random_safe", "flood_fill", "-W", 7, "-H", 7, "--rounds", 4, "--json")
    assert said.code == 0, said.err
    table = json.loads(said.out)
    assert table["games"] == 8
    assert table["standings"][0]["name"] == "flood_fill"
    assert {"points", "low", "high"} == set(table["standings"][0]["rating"])


def test_ctrl_c_ends_a_tournament_with_its_table_and_the_same_command_goes_on(tmp_path):
    players = ("flood_fill", "area_control", "-W", "11", "-H", "11", "--rounds", "3", "--file", "games.jsonl")
    command = ["snakes", "tournament", *players]
    with Begun(command, tmp_path) as held:
        while not held.stderr.readline().startswith("game 2 "):
            assert held.returncode is None
        held.send_signal(signal.SIGINT)
        out, err = held.communicate(timeout=60)
    kept = (tmp_path / "games.jsonl").read_text().splitlines()
    games = len(kept) - 1
    assert held.returncode == 130, err
    assert 2 <= games < 6
    assert f"Broken off after {games} of 6 games" in err
    assert f"{games} of 6 games were played" in out
    assert "flood_fill" in out
    done = ran([*command, "--json"], tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"{games} of 6 games are in the file already" in done.stderr
    assert f"game {games + 1} of 6" in done.stderr
    assert json.loads(done.stdout)["games"] == 6
    assert (tmp_path / "games.jsonl").read_text().splitlines()[: len(kept)] == kept


def test_play_says_who_killed_whom_and_which_turns_failed(racecraft, tmp_path):
    (tmp_path / "mine.py").write_text("def move(data):\n    return 'left' if data['turn'] != 1 else 1 / 0\n")
    said = racecraft("snakes", "play", "-u", "mine.py", "-u", "flood_fill", "-W", 11, "-H", 11, "-r", 2)
    assert said.code == 0, said.err
    assert "1 failed (turn 1)" in said.out
    assert "turn 1: mine.py:2: move() raised ZeroDivisionError" in said.out
    assert "wall-collision on turn" in said.out
    facts = json.loads(racecraft("snakes", "play", "-u", "mine.py", "-u", "hungry", "-r", 2, "--json").out)
    assert [seat["failed_turns"] for seat in facts["seats"]] == [[1], []]


def test_whose_body_it_was_is_said():
    from racecraft.worlds.battlesnake.actions.tournament import fate
    from racecraft.worlds.battlesnake.env.board import Snake
    from racecraft.worlds.battlesnake.players.messages import GameCard

    card = GameCard("g", names={"s0": "Flo", "s1": "Ann"})
    assert fate(Snake("s0", [(1, 1)], 90, "head-collision", "s1", 41), card) == "head-collision by Ann on turn 41"
    assert fate(Snake("s0", [(1, 1)], 90, "snake-self-collision", "s0", 7), card) == "snake-self-collision on turn 7"
    assert fate(Snake("s0", [(1, 1)]), card) == "alive"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("play", "-u", "hungry", "-g", "standrad"), "standard"),
        (("play", "-u", "hungry", "-n", "a", "-n", "b"), "2 names for 1 player;"),
        (("play", "-u", "http://127.0.0.1:1"), "127.0.0.1:1"),
        (("play", *("-u", "hungry") * 17), "players"),
        (("tournament", "hungry"), "2 snakes a game"),
        (("play", "-u", "hungry", "-u", "hungry", "-m", "solo_maze"), "with 2 snakes; expected at most 1."),
        (("serve", "nobody"), "nobody"),
        (("serve", "hungry", "--color", "#12345"), "expected #rrggbb"),
        (("play", "-u", "setup.py", "--file-memory", 3), "at least 64"),
        (("serve", "hungry", "--host", "256.0.0.1"), "256.0.0.1"),
    ],
)
def test_what_cannot_be_done_is_said_with_exit_code_2(racecraft, arguments, words):
    said = racecraft("snakes", *arguments)
    assert said.code == 2, said
    assert words in said.err
    assert "Traceback" not in said.err


def test_verify_counts_and_finds_differences(racecraft, tmp_path):
    point = {"id": "a", "health": 100, "cause": "", "by": "", "on": 0}
    game = {
        "t": "game", "w": 7, "h": 7, "ruleset": "solo", "map": "empty", "damage": 14, "shrink": 25, "chance": 0,
        "min": 0, "solo": True, "snakes": [point | {"body": [[3, 3]] * 3}], "food": [], "hazards": [],
    }  # fmt: skip
    step = {
        "t": "step", "turn": 0, "moves": {"a": "up"}, "food_pre": [], "haz_pre": [], "food_rules": [],
        "haz_rules": [], "food": [], "hazards": [],
        "snakes": [point | {"health": 99, "body": [[3, 4], [3, 3], [3, 3]]}],
    }  # fmt: skip
    (tmp_path / "good.jsonl").write_text("\n".join(json.dumps(line) for line in (game, step)))
    good = racecraft("snakes", "verify", "good.jsonl", "--json")
    assert good.code == 0, good.err
    assert json.loads(good.out) == {"games": 1, "steps": 1, "mismatches": 0, "examples": [], "unread": []}
    step["snakes"][0]["health"] = 98
    (tmp_path / "bad.jsonl").write_text("\n".join(json.dumps(line) for line in (game, step)))
    bad = racecraft("snakes", "verify", "bad.jsonl")
    assert bad.code == 1
    assert "1 game, 1 step, 2 mismatches" in bad.out
    assert "health 98" in bad.out


@pytest.mark.long
def test_recorded_games_of_the_official_engine_agree(racecraft):
    said = racecraft("snakes", "verify", RECORDS / "official_engine_trajectories.jsonl.gz", "--json")
    assert said.code == 0
    assert json.loads(said.out)["mismatches"] == 0


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_file_is_served_until_it_is_interrupted(tmp_path, how):
    (tmp_path / "mine.py").write_text("def move(data):\n    return 'up'\n")
    flags = ("--port", "0", "--color", "red", "--json")
    with Begun(["snakes", "serve", "mine.py", *flags], tmp_path) as server:
        url = json.loads(server.stdout.readline())["url"]
        with urllib.request.urlopen(url, timeout=60) as answer:
            assert json.load(answer)["color"] == "#ff0000"
        server.send_signal(how)
        _, err = server.communicate(timeout=60)
    assert server.returncode == 0, err
    assert "0 games, 0 moves" in err

"""The losing move: found where a person can tell it, in games as they are kept."""

import json

import pytest
from tests.evaluation.battlesnake.test_game_files import engine_frames, official, snake_log
from typer.testing import CliRunner

from racecraft.cli.app import app
from racecraft.contract.errors import InputFileError
from racecraft.envs.battlesnake.board import Board, Snake
from racecraft.envs.battlesnake.reference import apply_rules
from racecraft.envs.battlesnake.rulesets import find_ruleset
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.envs.battlesnake.stages import Table
from racecraft.evaluation.battlesnake.game_files import games_of, snake_names
from racecraft.evaluation.battlesnake.match import Played
from racecraft.evaluation.battlesnake.record import write_record
from racecraft.evaluation.battlesnake.study import judge, study_game
from racecraft.players.battlesnake.messages import GameCard
from racecraft.players.battlesnake.protocol import PlayerError

SETTINGS = GameSettings(7, 7, 2)
# To the left lies a pocket: upward of (0, 0) three squares, then its own body. To the right half the board.
POCKET = [(1, 0), (1, 1), (1, 2), (1, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4), (4, 4), (5, 4), (6, 4)]


@pytest.fixture(scope="module")
def played():
    """A game in which s0 enters a pocket at turn 9 and dies of it at turn 13, while s1 goes round."""
    board = Board(7, 7, 9, [Snake("s0", POCKET), Snake("s1", [(2, 6), (3, 6), (4, 6)])], [])
    game = Played(SETTINGS, GameCard("pocket", 500, {"s0": "greedy", "s1": "round"}), [board])
    moves = zip(("left", "up", "up", "up"), ("down", "left", "up", "right"), strict=True)
    for mine, other in moves:
        after = game.boards[-1].copy()
        apply_rules(find_ruleset("standard"), after, {"s0": mine, "s1": other}, Table(SETTINGS))
        after.turn += 1
        game.boards.append(after)
    assert [snake.cause for snake in game.boards[-1].snakes] == ["snake-self-collision", ""]
    return game


@pytest.fixture(scope="module")
def files(played, tmp_path_factory):
    """The same game as it may be kept."""
    folder = tmp_path_factory.mktemp("games")
    write_record(played, folder / "ours.jsonl")
    (folder / "official.jsonl").write_text("\n".join(json.dumps(line) for line in official(played)))
    (folder / "log.json").write_text(json.dumps(snake_log(played, "s0")))
    (folder / "frames.json").write_text(json.dumps(engine_frames(played)))
    return folder


@pytest.mark.parametrize("name", ["ours.jsonl", "official.jsonl", "log.json", "frames.json"])
def test_the_losing_move_is_the_last_that_had_a_choice(files, name):
    (game,) = games_of(files / name)
    (loss,) = study_game(game)
    assert (loss.snake_id, loss.turn, loss.played, loss.better) == ("s0", 9, "left", "right")
    assert loss.played_finding.loses
    assert not loss.better_finding.loses
    assert not loss.further_back
    assert loss.died_on == 13


def test_names_are_told_where_the_file_tells_them(files):
    assert snake_names(files / "ours.jsonl") == {"s0": "greedy", "s1": "round"}
    assert snake_names(files / "frames.json") == {"s0": "greedy", "s1": "round"}


def test_what_lies_too_far_back_is_said_to(files):
    (game,) = games_of(files / "ours.jsonl")
    (loss,) = study_game(game, most_back=2)
    assert loss.further_back
    assert loss.turn == 11


def test_a_move_into_the_wall_needs_no_search(played):
    found = judge(played.boards[0], SETTINGS, "s0", 100, "down")
    assert found.loses
    assert found.turns == 0


def test_who_did_not_lose_or_is_not_there_is_named(files):
    (game,) = games_of(files / "ours.jsonl")
    with pytest.raises(PlayerError, match="lives to the end"):
        study_game(game, ["s1"])
    with pytest.raises(PlayerError, match="no snake 's7'"):
        study_game(game, ["s7"])


def test_the_command_tells_it_in_words_and_as_json(files):
    said = CliRunner().invoke(app, ["snakes", "study", str(files / "ours.jsonl")])
    assert said.exit_code == 0
    assert "greedy (A): snake-self-collision on turn 13" in said.output
    assert "turn 9: played left, lost within 4 turns" in said.output
    assert "search would have played right" in said.output
    told = CliRunner().invoke(app, ["snakes", "study", str(files / "ours.jsonl"), "--snake", "greedy", "--json"])
    (loss,) = json.loads(told.stdout)["losses"]
    assert (loss["snake"], loss["name"], loss["turn"], loss["better"]) == ("s0", "greedy", 9, "right")
    (files / "bad.json").write_text("{}")
    refused = CliRunner().invoke(app, ["snakes", "study", str(files / "bad.json")])
    assert isinstance(refused.exception, InputFileError)

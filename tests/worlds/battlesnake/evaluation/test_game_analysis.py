"""The losing move: found where a person can tell it, in games as they are kept."""

import json

import pytest
from tests.worlds.battlesnake.evaluation.test_game_files import engine_frames, official, snake_log
from typer.testing import CliRunner

from racecraft.cli.app import app
from racecraft.contract.errors import InputFileError
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.records import RecordedGame, RecordedStep
from racecraft.worlds.battlesnake.env.reference import apply_rules
from racecraft.worlds.battlesnake.env.rulesets import find_ruleset
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import GameContext
from racecraft.worlds.battlesnake.evaluation.game_analysis import finding_text, search_position, study_game
from racecraft.worlds.battlesnake.evaluation.game_files import games_of
from racecraft.worlds.battlesnake.evaluation.match import Played
from racecraft.worlds.battlesnake.evaluation.record import write_record
from racecraft.worlds.battlesnake.players.alpha_beta_search import SearchResult
from racecraft.worlds.battlesnake.players.messages import GameCard
from racecraft.worlds.battlesnake.players.protocol import PlayerError

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
        apply_rules(find_ruleset("standard"), after, {"s0": mine, "s1": other}, GameContext(SETTINGS))
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


def test_what_lies_too_far_back_is_said_to(files):
    (game,) = games_of(files / "ours.jsonl")
    (loss,) = study_game(game, most_back=2)
    assert loss.further_back
    assert loss.turn == 11


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


@pytest.mark.parametrize(
    ("value", "depth", "said"),
    [
        (1_000_000 - 12, 9, "won within 7 turns"),  # a win is a million less the turn on which it comes
        (-1_000_000 + 6, 9, "lost within 1 turn"),
        (12_345, 3, "+1.23 after 3 turns"),  # worth is told in ten-thousandths
    ],
)
def test_what_search_finds_at_turn_5_is_said_in_words(value, depth, said):
    assert finding_text(SearchResult("up", value, depth), 5) == said


def test_a_fatal_move_is_lost_on_the_next_turn_without_a_look(played):
    board = played.boards[0]
    found = search_position(board, SETTINGS, "s0", 100, "down")
    assert (found.move, found.depth, finding_text(found, board.turn)) == ("down", 1, "lost within 1 turn")
    shut_in = Board(7, 7, 9, [Snake("s0", [(0, 0), (1, 0), (1, 1), (0, 1), (0, 2), (0, 3)]), board.snakes[1]], [])
    none = search_position(shut_in, SETTINGS, "s0", 100)
    assert (none.move, none.depth, none.turns, finding_text(none, 9)) == ("up", 1, 0, "lost within 1 turn")


def test_losses_come_in_the_order_of_their_ends_and_only_of_those_asked_for():
    """On 7 x 7 squares two run into the walls: s1 on turn 1, s0 on turn 2, while s2 goes round."""
    boards = [Board(7, 7, 0, [Snake("s0", [(1, 3)] * 3), Snake("s1", [(6, 0)] * 3), Snake("s2", [(4, 4)] * 3)], [])]
    settings = GameSettings(7, 7, 3)
    game = RecordedGame(1, settings, boards[0].copy())
    for two in ("up", "left"):
        before = boards[-1]
        after = before.copy()
        moves = {snake.id: {"s0": "left", "s1": "right", "s2": two}[snake.id] for snake in before.alive()}
        apply_rules(find_ruleset("standard"), after, moves, GameContext(settings))
        ruled = after.copy()
        after.turn += 1
        game.steps.append(RecordedStep(moves, before.copy(), ruled, after.copy()))
        boards.append(after)
    losses = study_game(game, effort=50)
    assert [(loss.snake_id, loss.died_on, loss.turn, loss.played) for loss in losses] == [
        ("s1", 1, 0, "right"), ("s0", 2, 1, "left")
    ]  # fmt: skip
    assert [loss.snake_id for loss in study_game(game, ["s0"], effort=50)] == ["s0"]
    assert study_game(RecordedGame(1, settings, boards[0])) == [], "nothing was recorded, so nobody lost"

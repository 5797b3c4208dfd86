"""Gauntlets: weights are tuned by playing, they go on where they stopped, and what was gained is proven afresh."""

import json

import pytest

from racecraft.contract.errors import InputFileError, SettingError
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.league.spsa import GauntletSettings, WeightTuner
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.players.kernels.worth import evaluate
from racecraft.worlds.battlesnake.players.search_position import fill_buffers, position_of
from racecraft.worlds.battlesnake.players.weights import DEFAULT_WEIGHTS, Weights, read_weights, weights_text

TINY = GauntletSettings(rounds=4, proof=6, effort=16, width=7, height=7, most_turns=20)


def run(path, settings=TINY, start=DEFAULT_WEIGHTS, stop_after=None):
    told = []

    def tell(sentence):
        told.append(sentence)
        if stop_after is not None and len(told) >= stop_after:
            raise KeyboardInterrupt

    gauntlet = WeightTuner(path, settings, start)
    try:
        gauntlet.run(tell)
    except KeyboardInterrupt:
        assert stop_after is not None
    return gauntlet


def test_it_goes_on_where_it_was_stopped_and_ends_the_same(tmp_path):
    whole = run(tmp_path / "whole.json")
    assert (len(whole.scores), len(whole.proof)) == (4, 6)
    run(tmp_path / "parts.json", stop_after=1)
    assert len(json.loads((tmp_path / "parts.json").read_text())["gauntlet"]["scores"]) == 1
    run(tmp_path / "parts.json", stop_after=2)
    run(tmp_path / "parts.json")
    assert (tmp_path / "parts.json").read_bytes() == (tmp_path / "whole.json").read_bytes()
    assert read_weights(tmp_path / "whole.json") == whole.weights()


def test_weights_move_towards_whoever_wins(tmp_path, monkeypatch):
    """The side with more weight on squares always wins: squares grow, and nothing is gained without a difference."""

    def judged(self, one, other, dice, turn):
        return float(one.squares > other.squares)

    monkeypatch.setattr(WeightTuner, "_game", judged)
    found = run(tmp_path / "w.json", GauntletSettings(rounds=60, proof=4)).weights()
    assert found.squares > 0.75
    assert found.squares + found.length + found.meal == pytest.approx(1, abs=1e-3)
    monkeypatch.setattr(WeightTuner, "_game", lambda *_: 0.5)
    assert run(tmp_path / "even.json", GauntletSettings(rounds=10, proof=4)).weights() == DEFAULT_WEIGHTS


def test_proof_meets_dice_and_seats_that_are_fair(tmp_path, monkeypatch):
    games = []
    monkeypatch.setattr(WeightTuner, "_game", lambda self, one, other, dice, turn: games.append((dice, turn)) or 0.25)
    gauntlet = run(tmp_path / "w.json", GauntletSettings(rounds=2, proof=4, snakes=2))
    assert games == [
        ("round 0", 0), ("round 0", 1), ("round 1", 0), ("round 1", 1),
        ("proof 0", 0), ("proof 0", 1), ("proof 1", 0), ("proof 1", 1),
    ]  # fmt: skip
    share, low, high = gauntlet.proven()
    assert share == 0.25
    assert low < 0.25 < high


def test_a_game_is_won_by_the_side_of_the_last_alive(tmp_path):
    """Weights that see nothing in room and squares lose to the usual ones, at whichever seat they begin."""
    gauntlet = WeightTuner(tmp_path / "w.json", GauntletSettings(effort=100, width=7, height=7), DEFAULT_WEIGHTS)
    blind = Weights(squares=0.0, length=0.0, meal=1.0, health=1.0, room=0.0)
    took = [gauntlet._game(DEFAULT_WEIGHTS, blind, f"dice {dice}", turn) for dice in range(3) for turn in (0, 1)]
    assert sum(took) >= 4
    four = WeightTuner(tmp_path / "f.json", GauntletSettings(effort=16, snakes=4, width=7, height=7), DEFAULT_WEIGHTS)
    assert 0 <= four._game(DEFAULT_WEIGHTS, blind, "dice", 3) <= 1


def test_weights_are_read_by_search(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(weights_text(Weights(squares=0.9, room=0.1), {}))
    assert find_player(f"search:{path}").weights == Weights(squares=0.9, room=0.1)
    settings = GameSettings(7, 7, 2)
    board = Board(7, 7, snakes=[Snake("a", [(1, 1)] * 3), Snake("b", [(5, 5), (5, 4), (5, 3), (5, 2)])], food=[(3, 3)])
    worths = {}
    for weights in (DEFAULT_WEIGHTS, Weights(length=1.0, squares=0.0, meal=0.0, room=0.0)):
        position = position_of(board, settings, weights=weights)
        worths[weights] = [0.0, 0.0]
        row = position.rows[0, :, 0].astype(float)
        evaluate(0, *position, *fill_buffers(position), row)
        worths[weights] = row.tolist()
    lengths = worths[Weights(length=1.0, squares=0.0, meal=0.0, room=0.0)]
    assert lengths == pytest.approx([3 / 7, 4 / 7])
    assert worths[DEFAULT_WEIGHTS] != pytest.approx(lengths)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "no JSON"),
        (weights_text(DEFAULT_WEIGHTS, {}).replace("squares", "sqares"), "There is no weight 'sqares'"),
        (weights_text(DEFAULT_WEIGHTS, {}).replace("0.6", "1.6"), "is 1.6; expected a number from 0 to 1"),
    ],
)
def test_files_that_are_no_weights_are_named(tmp_path, text, said):
    path = tmp_path / "w.json"
    path.write_text(text)
    with pytest.raises(InputFileError, match=said):
        read_weights(path)


def test_another_gauntlet_is_not_gone_on_with(tmp_path, monkeypatch):
    monkeypatch.setattr(WeightTuner, "_game", lambda *_: 0.5)
    path = tmp_path / "w.json"
    run(path)
    with pytest.raises(InputFileError, match="another gauntlet \\(rounds 4, now 5\\)"):
        WeightTuner(
            path, GauntletSettings(rounds=5, proof=6, effort=16, width=7, height=7, most_turns=20), DEFAULT_WEIGHTS
        )
    path.write_text(weights_text(DEFAULT_WEIGHTS, {}))
    with pytest.raises(InputFileError, match="weights of which no gauntlet tells"):
        WeightTuner(path, TINY, DEFAULT_WEIGHTS)
    with pytest.raises(SettingError, match="3 snakes at a board"):
        GauntletSettings(snakes=3)

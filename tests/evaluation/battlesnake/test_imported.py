"""Games that were played elsewhere, brought home: whole files, the engine's pieces, and what is no game."""

import json

import pytest
from tests.evaluation.battlesnake.test_game_files import engine_frames, events, game_of, official, snake_log

from racecraft.contract.errors import InputFileError
from racecraft.evaluation.battlesnake.imported import import_game
from racecraft.evaluation.battlesnake.record import read_record, write_record


@pytest.fixture(scope="module")
def played():
    return game_of()


def written(path, value):
    lines = value if isinstance(value, list) else [value]
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


def pieces_of(played, folder):
    """Write what the engine answers: the game with its last frame, and two pages of frames."""
    told = engine_frames(played)
    game, frames = told["Game"], told["Frames"]
    half = len(frames) // 2
    pages = [{"Count": len(page), "Frames": page} for page in (frames[:half], frames[half:])]
    answers = {"info": {"Game": game, "LastFrame": frames[-1]}, "first": pages[0], "second": pages[1]}
    return {name: written(folder / f"{name}.json", answer) for name, answer in answers.items()}


@pytest.fixture
def pieces(played, tmp_path):
    return pieces_of(played, tmp_path)


def same_game(found, played):
    assert found.mismatches == 0
    ours = found.played
    assert (ours.settings, ours.winner, ours.over) == (played.settings, played.winner, True)
    assert list(ours.card.names.values()) == list(played.card.names.values())
    for one, other in zip(ours.boards, played.boards, strict=True):
        assert [(s.id, s.body, s.health, s.cause, s.on) for s in one.alive()] == [
            (s.id, s.body, s.health, s.cause, s.on) for s in other.alive()
        ]
        assert (sorted(one.food), one.hazards, one.turn) == (sorted(other.food), other.hazards, other.turn)


def test_the_engines_answers_become_one_game_in_whatever_order_they_are_given(played, pieces, tmp_path):
    found = import_game([pieces["second"], pieces["info"], pieces["first"]])
    same_game(found, played)
    colours = [snake["Color"] for snake in engine_frames(played)["Frames"][0]["Snakes"]]
    assert [look["color"] for look in found.played.card.looks.values()] == colours
    assert (found.played.card.id, found.played.card.timeout_ms) == (played.card.id, 5000)
    write_record(found.played, tmp_path / "game.jsonl")
    same = [[snake.cause for snake in board.snakes] for board in read_record(tmp_path / "game.jsonl").boards]
    assert same == [[snake.cause for snake in board.snakes] for board in played.boards]


@pytest.mark.parametrize("form", [official, snake_log, engine_frames, events])
def test_every_form_that_is_verified_is_imported(played, tmp_path, form):
    same_game(import_game([written(tmp_path / "game.json", form(played))]), played)


def test_events_tell_the_game_in_their_last_line_too(played, tmp_path):
    """The official program's board is asked for the game apart; its events name it in {"game": …} at the end."""
    first, *frames, end = events(played)
    lines = [*frames, {"Type": "game_end", "Data": {"game": first["Game"]}}]
    same_game(import_game([written(tmp_path / "events.jsonl", lines)]), played)
    assert end["Type"] == "game_end"


def test_a_missing_piece_is_named_with_what_it_is(pieces):
    with pytest.raises(InputFileError, match=r"first\.json: no Game .*together to `snakes import`"):
        import_game([pieces["first"]])
    with pytest.raises(InputFileError, match=r"no frames"):
        import_game([pieces["info"]])


def test_pieces_of_two_games_are_not_mixed(pieces, tmp_path):
    other = json.loads(pieces["info"].read_text())
    other["Game"]["ID"] = "another"
    with pytest.raises(InputFileError, match=r"other\.json: game 'another' beside game 'game'"):
        import_game([*pieces.values(), written(tmp_path / "other.json", other)])
    with pytest.raises(InputFileError, match=r"shopping\.json: neither 'Game' nor 'Frames'"):
        import_game([*pieces.values(), written(tmp_path / "shopping.json", {"milk": 1})])

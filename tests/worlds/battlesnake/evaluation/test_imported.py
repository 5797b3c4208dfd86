"""Games that were played elsewhere, brought home: whole files, the engine's pieces, and what is no game."""

import json

import pytest
from tests.worlds.battlesnake.evaluation.test_game_files import (
    engine_frames,
    events,
    frames_of_one,
    game_of,
    official,
    snake_log,
)

from racecraft.contract.errors import InputFileError
from racecraft.worlds.battlesnake.evaluation.imported import import_game
from racecraft.worlds.battlesnake.evaluation.record import read_record, write_record


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
    assert [look["color"] for look in found.played.card.appearances.values()] == colours
    assert (found.played.card.id, found.played.card.timeout_ms) == (played.card.id, 5000)
    write_record(found.played, tmp_path / "game.jsonl")
    same = [[snake.cause for snake in board.snakes] for board in read_record(tmp_path / "game.jsonl").boards]
    assert same == [[snake.cause for snake in board.snakes] for board in played.boards]


@pytest.mark.parametrize("form", [official, snake_log, engine_frames, events])
def test_every_form_that_is_verified_is_imported(played, tmp_path, form):
    same_game(import_game([written(tmp_path / "game.json", form(played))]), played)


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


def test_of_several_games_the_one_that_is_named_is_read(played, tmp_path):
    first, *turns = official(played)
    path = written(tmp_path / "games.json", [first, *turns, {"id": "again"}, *turns[:4]])
    assert import_game([path], 1).played.turns == played.turns
    second = import_game([path], 2).played
    assert (second.turns, second.over) == (3, False)
    with pytest.raises(InputFileError, match="2 games; expected one, or --game with a number from 1 to 2"):
        import_game([path])
    for number in (0, 3, -1):
        with pytest.raises(InputFileError, match=f"2 games, no number {number}; expected --game from 1 to 2"):
            import_game([path], number)
    with pytest.raises(InputFileError, match="1 game, no number 2"):
        import_game([written(tmp_path / "one.json", [first, *turns])], 2)


def test_what_the_files_do_not_tell_is_as_ours_has_it(tmp_path):
    """A game without a name is called as its file, a snake without one as its id; half a second is the usual time."""
    plain = import_game([written(tmp_path / "spring.final.json", frames_of_one())]).played.card
    assert (plain.id, plain.timeout_ms, plain.source) == ("spring", 500, "")
    assert (plain.names, plain.appearances) == ({"one": "one"}, {"one": {}})


@pytest.mark.parametrize(("told", "read"), [(0, 500), ("9", 500), (750, 750)])
def test_a_time_for_an_answer_is_read_where_it_is_one(tmp_path, told, read):
    card = import_game(
        [written(tmp_path / "a.json", frames_of_one(ID="g", SnakeTimeout=told, Source="arena"))]
    ).played.card
    assert (card.id, card.timeout_ms, card.source) == ("g", read, "arena")


def test_names_and_looks_are_texts_of_whoever_has_a_body(tmp_path):
    frames = frames_of_one(ID="one", Name="no snake")
    frames["Frames"][0]["Snakes"][0] |= {"Name": "Ann", "Color": "#00ff00", "HeadType": "", "TailType": 3}
    card = import_game([written(tmp_path / "a.json", frames)]).played.card
    assert (card.names, card.appearances) == ({"one": "Ann"}, {"one": {"color": "#00ff00"}})
    frames["Frames"][0]["Snakes"][0]["customizations"] = {"color": "red", "head": "bendr", "tail": None, "hat": "top"}
    card = import_game([written(tmp_path / "a.json", frames)]).played.card
    assert card.appearances == {"one": {"color": "red", "head": "bendr"}}


def test_a_game_that_our_rules_would_have_told_otherwise_is_counted(played, tmp_path):
    frames = engine_frames(played)
    living = [snake for snake in frames["Frames"][3]["Snakes"] if not snake["Death"]]
    living[0]["Health"] -= 1
    assert import_game([written(tmp_path / "a.json", frames)]).mismatches > 0

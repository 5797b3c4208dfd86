"""The official output file, line by line: what is written of a small game by hand, and what may stand in its place."""

import json
from dataclasses import replace

import pytest

from racecraft.contract.errors import InputFileError
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation import record
from racecraft.worlds.battlesnake.evaluation.match import Played
from racecraft.worlds.battlesnake.evaluation.record import played_in, read_record, record_text, verdict, write_record
from racecraft.worlds.battlesnake.players.messages import LOOKS, GameCard

SETTINGS = GameSettings(5, 5, 3)
GREEN = LOOKS | {"color": "#00ff00"}


def game(*ends):
    """Three snakes; at turn 1 `b` has left, at turn 2 whoever `ends` names too."""
    bodies = {"a": [(0, 0), (0, 1)], "b": [(2, 2), (2, 1)], "c": [(4, 4), (4, 3)]}
    left = Snake("b", [(2, 2), (3, 2)], 60, "head-collision", "a", 1)
    first = Board(5, 5, 0, [Snake(one, body, 90) for one, body in bodies.items()], [(1, 1)])
    second = Board(5, 5, 1, [Snake("a", [(1, 0), (0, 0)], 89), left, Snake("c", [(4, 3), (4, 4)], 89)])
    last = Board(5, 5, 2, [Snake("a", [(2, 0), (1, 0)], 88), left, Snake("c", [(4, 2), (4, 3)], 88)])
    for number, one in enumerate(last.snakes):
        if one.id in ends:
            last.snakes[number] = replace(one, cause="hazard", by="", on=2, health=0)
    looks = {"a": LOOKS, "b": LOOKS, "c": GREEN}
    return Played(SETTINGS, GameCard("g", 300, {"a": "Ann", "b": "Bob", "c": "Cid"}, looks), [first, second, last])


def lines_of(played):
    return [json.loads(line) for line in record_text(played).splitlines()]


def read(lines, tmp_path):
    path = tmp_path / "game.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return read_record(path)


def test_a_line_is_the_card_then_every_turn_then_the_verdict(tmp_path):
    played = game("c")
    head, *turns, end = lines_of(played)
    assert (head["id"], head["timeout"]) == ("g", 300)
    assert [(line["turn"], line["you"]["id"]) for line in turns] == [(0, "a"), (1, "a"), (2, "a")]
    assert [snake["id"] for snake in turns[2]["board"]["snakes"]] == ["a"]
    assert end == {
        "winnerId": "a",
        "winnerName": "Ann",
        "isDraw": False,
        "eliminations": [
            {"id": "b", "cause": "head-collision", "by": "a", "turn": 1, "health": 60,
             "body": [{"x": 2, "y": 2}, {"x": 3, "y": 2}]},
            {"id": "c", "cause": "hazard", "by": "", "turn": 2, "health": 0,
             "body": [{"x": 4, "y": 2}, {"x": 4, "y": 3}]},
        ],
    }  # fmt: skip
    assert ": " not in record_text(played), "dense, as the official program writes it"
    write_record(played, tmp_path / "game.jsonl")
    again = read_record(tmp_path / "game.jsonl")
    assert (again.boards, again.card.names, again.card.appearances) == (
        played.boards,
        played.card.names,
        played.card.appearances,
    )
    assert (again.settings, again.over) == (SETTINGS, True)


@pytest.mark.parametrize(
    ("ends", "solo", "said"),
    [
        ("c", None, ("a", "Ann", False)),
        ("ac", None, ("", "", True)),
        ("", None, ("", "", False)),
        ("c", True, ("", "", False)),
        ("ac", True, ("", "", False)),
    ],
)
def test_a_draw_is_a_game_of_several_that_nobody_survived(ends, solo, said):
    played = game(*ends)
    told = verdict(replace(played, settings=replace(SETTINGS, solo=solo)))
    assert (told["winnerId"], told["winnerName"], told["isDraw"]) == said


def test_who_left_without_a_word_lies_where_it_was_seen_last(tmp_path):
    """The official program tells nothing of the dead."""
    *lines, end = lines_of(game("c"))
    del end["eliminations"]
    boards = read([*lines, end], tmp_path).boards
    assert boards[0].snakes[1].cause == ""
    b, c = Snake("b", [(2, 2), (2, 1)], 90, "eliminated", "", 1), Snake("c", [(4, 3), (4, 4)], 89, "eliminated", "", 2)
    assert (boards[1].snakes[1], boards[2].snakes[1:]) == (b, [b, c])
    assert [snake.id for snake in boards[2].snakes] == ["a", "b", "c"], "in the order in which they began"


def test_names_and_looks_are_those_that_are_told_else_the_id_and_none(tmp_path):
    lines = lines_of(game())
    for line in lines[1:-1]:
        for snake in line["board"]["snakes"]:
            snake.update({"a": {"name": ""}, "c": {"customizations": "green"}}.get(snake["id"], {}))
    card = read(lines, tmp_path).card
    assert card.names == {"a": "a", "b": "Bob", "c": "Cid"}
    assert card.appearances == {"a": LOOKS, "b": LOOKS, "c": {}}
    assert (card.id, card.timeout_ms) == ("g", 300)


def test_lines_that_are_none_of_the_games_are_passed_over(tmp_path):
    lines = lines_of(game("c"))
    assert len(read([lines[1], *lines[1:]], tmp_path).boards) == 3, "the first line is the card whatever it holds"
    assert len(read([lines[0], [3], 5, {"note": 1}, *lines[1:]], tmp_path).boards) == 3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda lines: lines[:1], r"game\.jsonl: no turn in it"),
        (lambda lines: [*lines[:2], {"board": 3}], r"game\.jsonl:3: "),
        (lambda lines: [*lines[:3], {**lines[3], "board": {**lines[3]["board"], "width": 6}}], "boards of 2 sizes"),
    ],
)
def test_what_is_no_such_file_is_refused_by_its_line(tmp_path, change, words):
    with pytest.raises(InputFileError, match=words):
        read(change(lines_of(game("c"))), tmp_path)


def test_a_file_that_is_no_text_or_not_there_is_refused(tmp_path):
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(InputFileError, match="no UTF-8 text"):
        read_record(tmp_path / "picture.png")
    with pytest.raises(InputFileError, match="No such file"):
        read_record(tmp_path / "none.jsonl")


def test_a_line_may_have_four_megabytes_and_not_a_letter_more(tmp_path, monkeypatch):
    assert record.MAX_LINE_BYTES == 4 * 2**20
    texts = record_text(game()).splitlines()
    longest = max(map(len, texts))
    monkeypatch.setattr(record, "MAX_LINE_BYTES", longest)
    assert len(played_in(texts, tmp_path).boards) == 3
    monkeypatch.setattr(record, "MAX_LINE_BYTES", longest - 1)
    with pytest.raises(InputFileError, match=f"{longest} characters"):
        played_in(texts, tmp_path)

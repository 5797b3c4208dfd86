"""`racecraft snakes import`, as a user types it."""

import json

from tests.worlds.battlesnake.evaluation.test_game_files import game_of
from tests.worlds.battlesnake.evaluation.test_imported import pieces_of, written


def test_one_of_several_games_is_chosen_by_number(racecraft, tmp_path):
    start = {"w": 7, "h": 7, "ruleset": "standard", "map": "empty", "damage": 14, "shrink": 25, "chance": 0, "min": 0}
    snake = {"id": "a", "health": 100, "body": [[1, 1], [1, 1], [1, 1]], "cause": "", "by": "", "on": 0}
    games = [start | {"t": "game", "solo": True, "snakes": [snake | {"id": one}], "food": [], "hazards": []}
             for one in "ab"]  # fmt: skip
    written(tmp_path / "two.jsonl", games)
    refused = racecraft("snakes", "import", "two.jsonl")
    assert refused.code == 2
    assert "two.jsonl: 2 games" in refused.err
    assert "--game with a number from 1 to 2" in refused.err
    assert racecraft("snakes", "import", "two.jsonl", "--game", 3).code == 2
    said = json.loads(racecraft("snakes", "import", "two.jsonl", "--game", 2, "--out", "b.jsonl", "--json").out)
    told = {"file": "b.jsonl", "snakes": ["b"], "turns": 0, "over": False, "winner": "", "mismatches": 0}
    assert said == told


def test_a_game_is_imported_watched_and_studied(racecraft, tmp_path):
    pieces = pieces_of(game_of(), tmp_path)
    said = racecraft("snakes", "import", *pieces.values(), "--out", "home.jsonl")
    assert (said.code, said.out) == (
        0,
        "home.jsonl: flood_fill0, hungry1, random_safe2; 24 turns, won by flood_fill0\n",
    )
    assert racecraft("snakes", "verify", "home.jsonl").code == 0
    assert racecraft("snakes", "watch", "home.jsonl", "--html", "home.html").code == 0
    assert "search would have played" in racecraft("snakes", "study", "home.jsonl", "--effort", 200).out
    missing = racecraft("snakes", "import", pieces["info"], "--out", "nowhere/home.jsonl")
    assert (missing.code, "its folder does not exist" in missing.err) == (2, True)

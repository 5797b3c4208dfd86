"""Games as they are kept: what ours and the official program write, a snake's own log, the engine's frames."""

import gzip
import itertools
import json
import os
import random
from dataclasses import replace
from pathlib import Path

import pytest
from tests.reference import DATA

from racecraft.contract.errors import InputFileError, UserInputError
from racecraft.worlds.battlesnake.analysis.board_frames import frame, game_end, game_facts
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.maps import MAPS
from racecraft.worlds.battlesnake.env.records import read_games
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation import game_files
from racecraft.worlds.battlesnake.evaluation.game_files import games_of, snake_names, values_in, verify_file
from racecraft.worlds.battlesnake.evaluation.match import Played, play
from racecraft.worlds.battlesnake.evaluation.record import read_record, verdict, write_record
from racecraft.worlds.battlesnake.evaluation.seats import take_seat
from racecraft.worlds.battlesnake.players.messages import GameCard, message

RECORDS = DATA / "battlesnake"


def game_of(players=3, seed=5, **settings):
    asked = GameSettings(**{"width": 11, "height": 11, "players": players, **settings})
    names = ("flood_fill", "hungry", "random_safe", "flood_fill")
    seats = [take_seat(name, f"{name}{n}", n) for n, name in zip(range(players), itertools.cycle(names), strict=False)]
    return play(asked, seats, StreamDice(seed), timeout_ms=5000, most_turns=400)


@pytest.fixture(scope="module")
def played():
    return game_of()


def official(played):
    """The official output file: no word of how snakes died."""
    lines = [{"id": played.card.id, "ruleset": {"name": played.settings.ruleset}}]
    for board in played.boards:
        lines.append(message(board, played.settings, (board.alive() or board.snakes)[0].id, played.card))
    return [*lines, verdict(played)]


def snake_log(played, who="s1"):
    """A snake's own log: requests while it lives, then the end."""
    boards = [board for board in played.boards if any(snake.id == who and snake.alive for snake in board.snakes)]
    requests = [message(board, played.settings, who, played.card) for board in boards]
    end = message(played.boards[-1], played.settings, who, played.card)
    return {"start_request": requests[0], "moves": [[one, {"move": "up"}] for one in requests], "end_request": end}


def engine_frames(played):
    frames = [frame(board, played.card)["Data"] for board in played.boards]
    return {"Game": game_facts(played.settings, played.card, "complete"), "Frames": frames}


def events(played):
    return [
        {"Game": game_facts(played.settings, played.card)}, *(frame(board, played.card) for board in played.boards),
        game_end(played.settings, played.card),
    ]  # fmt: skip


def verified(path, value):
    lines = value if isinstance(value, list) else [value]
    text = "".join(json.dumps(line) + "\n" for line in lines).encode()
    path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)
    return verify_file(path)


FORMS = {"output": official, "log": snake_log, "frames": engine_frames, "events": events}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", ["game.json", "game.json.gz"])
def test_a_game_is_verified_from_every_form_it_is_kept_in(played, tmp_path, form, name):
    report = verified(tmp_path / name, FORMS[form](played))
    assert report.games == 1
    lasted = played.turns if form != "log" else played.boards[-1].snakes[1].on or played.turns
    assert lasted - 1 <= report.steps <= lasted
    assert report.steps > 20
    assert report.agrees, "\n".join(report.examples)


def test_a_game_of_which_one_turn_was_written_is_that_turn(played, tmp_path):
    path = tmp_path / "game.jsonl"
    write_record(played, path)
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:2]))
    read = read_record(path)
    assert read.boards == played.boards[:1]
    assert read.card == replace(played.card, latencies_ms={})
    path.write_text("".join(json.dumps(line) + "\n" for line in official(played)[:2]))
    (game,) = games_of(path)
    assert game.settings == played.settings


def test_our_own_output_tells_how_they_died_and_is_held_to_it(played, tmp_path):
    path = tmp_path / "game.jsonl"
    write_record(played, path)
    assert verify_file(path).agrees
    lines = path.read_text().splitlines()
    end = json.loads(lines[-1])
    cause = end["eliminations"][0]["cause"]
    end["eliminations"][0]["cause"] = "hazard" if cause != "hazard" else "wall-collision"
    path.write_text("\n".join([*lines[:-1], json.dumps(end)]))
    assert not verify_file(path).agrees


@pytest.mark.parametrize("name", MAPS)
def test_games_on_every_map_read_back(tmp_path, name):
    chosen = MAPS[name]
    width, height = next(iter(chosen.sizes), (11, 11)) if chosen.sizes else (11, 11)
    players = 1 if name == "solo_maze" else 3
    game = game_of(players, width=width, height=height, map=name, solo=True if players == 1 else None)
    path = tmp_path / "game.jsonl"
    write_record(game, path)
    report = verify_file(path)
    assert report.agrees, "\n".join(report.examples)
    assert report.steps == game.turns


@pytest.mark.parametrize("ruleset", ["royale", "wrapped", "constrictor", "wrapped_constrictor", "solo"])
def test_games_of_every_ruleset_read_back(tmp_path, ruleset):
    game = game_of(1 if ruleset == "solo" else 4, ruleset=ruleset, shrink_every=5)
    report = verified(tmp_path / "game.jsonl", official(game))
    assert report.agrees, "\n".join(report.examples)
    assert report.steps == game.turns


@pytest.mark.parametrize("name", ["snail_mode", "hz_spiral"])
def test_royale_on_a_map_with_hazards_of_its_own_reads_back(tmp_path, name):
    report = verified(tmp_path / "game.jsonl", official(game_of(4, ruleset="royale", map=name, shrink_every=5)))
    assert report.agrees, "\n".join(report.examples)
    assert report.steps > 5


def test_a_royale_may_outlast_the_last_square_that_closes_in(tmp_path):
    game = game_of(1, width=7, height=7, ruleset="royale", hazard_damage=0, shrink_every=1, solo=True)
    assert game.turns > 7 + 7
    report = verified(tmp_path / "game.jsonl", official(game))
    assert report.agrees, "\n".join(report.examples)


OFFICIAL = Path(__file__).with_name("official_output.jsonl.gz")
"""What `battlesnake play --output` of the official program (commit 87e094e) wrote while snakes of ours answered it:
royale on its map, wrapped constrictor, and arcade_maze, one file after another."""


def test_what_the_official_program_wrote_is_verified_game_by_game():
    report = verify_file(OFFICIAL)
    assert (report.games, report.steps, report.mismatches, report.unread) == (3, 58 + 9 + 39, 0, [])
    assert [game.settings.map for game in games_of(OFFICIAL)] == ["royale", "standard", "arcade_maze"]
    assert [game.over_turn for game in games_of(OFFICIAL)] == [58, 9, 39]


def test_a_wrong_move_in_the_last_game_of_a_file_is_found_at_its_line(tmp_path):
    lines = gzip.decompress(OFFICIAL.read_bytes()).splitlines()
    begins = [n for n, line in enumerate(lines) if b'"board"' not in line and b'"winnerId"' not in line]
    turn = json.loads(lines[begins[2] + 20])
    turn["board"]["snakes"][0]["health"] -= 1
    lines[begins[2] + 20] = json.dumps(turn).encode()
    (tmp_path / "games.jsonl").write_bytes(b"\n".join(lines))
    report = verify_file(tmp_path / "games.jsonl")
    assert report.games == 3
    assert not report.agrees
    assert report.examples[0].startswith(f"game at line {begins[2] + 1} (standard on arcade_maze), turn 18")


def test_a_missing_turn_is_told_with_what_was_not_verified(played, tmp_path):
    lines = official(played)
    report = verified(tmp_path / "game.jsonl", [*lines[:12], *lines[13:]])
    assert report.steps == 10
    assert report.agrees
    assert report.unread == ["game at line 1: turn 11 is missing; the turns after it were not verified"]


def test_frames_that_do_not_say_when_a_snake_died_are_verified_all_the_same(played, tmp_path):
    frames = engine_frames(played)
    dead = [snake for frame in frames["Frames"] for snake in frame["Snakes"] if snake.get("Death")]
    for snake in dead:
        snake["Death"]["Turn"] = None
    assert dead
    report = verified(tmp_path / "frames.json", frames)
    assert report.agrees, "\n".join(report.examples)
    (game,) = games_of(tmp_path / "frames.json")
    assert game.over_turn == played.turns


SPOILT = {
    "health": lambda board: board["snakes"][0].update(health=board["snakes"][0]["health"] - 1),
    "a body": lambda board: board["snakes"][0]["body"].append(board["snakes"][0]["body"][-1]),
    "a jump": lambda board: board["snakes"][0]["body"].insert(0, {"x": 0, "y": 0}),
    "food on a snake": lambda board: board["food"].append(board["snakes"][0]["body"][0]),
    "food that went": lambda board: board["food"].clear(),
    "a hazard": lambda board: board["hazards"].append({"x": 3, "y": 3}),
    "a snake that left": lambda board: board["snakes"].pop(),
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_spoilt_game_is_found(played, tmp_path, what):
    lines = official(played)
    SPOILT[what](lines[6]["board"])
    report = verified(tmp_path / "game.jsonl", lines)
    assert not report.agrees
    assert "turn" in report.examples[0]


def test_games_of_the_official_engine_agree_when_only_positions_are_kept(tmp_path):
    """Every fourth one, of every kind; all of them by the moves in test_records.py."""
    games, steps = read_games(RECORDS / "official_engine_trajectories.jsonl.gz"), 0
    for number, game in enumerate(itertools.islice(games, 0, None, 4)):
        boards = [game.start, *(step.after_map for step in game.steps)]
        played = Played(game.settings, GameCard(f"g{number}"), boards)
        report = verified(tmp_path / "game.jsonl", official(played))
        assert report.agrees, f"game {number}\n" + "\n".join(report.examples)
        steps += report.steps
    assert steps > 300


LOGS = os.environ.get("RACECRAFT_SNAKE_LOGS")


@pytest.mark.skipif(not LOGS, reason="RACECRAFT_SNAKE_LOGS names no folder of snakes' logs of production games")
def test_production_games_agree():
    steps = 0
    for path in sorted(Path(LOGS).glob("*.json*")):
        report = verify_file(path)
        assert report.agrees, f"{path.name}\n" + "\n".join(report.examples)
        steps += report.steps
    assert steps > 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no game in it"),
        ("hello", "no JSON"),
        ("[1]", "no JSON object"),
        ("{}", "no turn"),
        ('{"start_request": {}, "moves": []}', "game is missing|KeyError|expected"),
        ('{"Frames": []}', "no Game"),
        ('{"Game": {"Width": 7, "Height": 7}, "Frames": [3]}', "TypeError"),
        ('{"id": "g"}\n{"board": 3, "game": {}}', "line 2|:2"),
    ],
)
def test_what_is_no_game_is_refused(tmp_path, text, words):
    path = tmp_path / "game.json"
    path.write_text(text)
    with pytest.raises(UserInputError, match=words):
        verify_file(path)


def test_a_ruleset_that_we_do_not_know_is_refused(played, tmp_path):
    lines = json.loads(json.dumps(official(played)).replace('"standard"', '"standrad"'))
    with pytest.raises((InputFileError, BoardError), match="standrad.*standard"):
        verified(tmp_path / "game.jsonl", lines)


def spoil(value, rng):
    if isinstance(value, dict) and value:
        key = rng.choice(sorted(value))
        if rng.random() < 0.1:
            del value[key]
        else:
            value[key] = spoil(value[key], rng)
        return value
    if isinstance(value, list) and value:
        place = rng.randrange(len(value))
        value[place] = spoil(value[place], rng)
        return value
    return rng.choice([None, -1, 10**9, "x", [], {}, 3.5, True, [[0, 0]], [[99, -5]], 10**400])


@pytest.mark.parametrize("form", FORMS)
def test_spoilt_files_end_in_a_report_or_a_letter(played, tmp_path, form):
    short = Played(played.settings, played.card, played.boards[:4], over=False)
    rng, outcomes = random.Random(form), set()
    for number in range(120):
        value = json.loads(json.dumps(FORMS[form](short)))
        value = spoil(value, rng)
        try:
            outcomes.add(verified(tmp_path / f"{number}.json", value).agrees)
        except UserInputError:
            outcomes.add("letter")
    assert "letter" in outcomes


def kept(path, *lines, end="\n"):
    path.write_text("\n".join(json.dumps(line) for line in lines) + end)
    return path


@pytest.mark.parametrize("end", ["\n", ""])
def test_two_lines_are_two_values_whether_or_not_the_last_one_ends(played, tmp_path, end):
    path = kept(tmp_path / "game.json", *official(played)[:2], end=end)
    assert [set(value) for value in values_in(path)] == [{"id", "ruleset"}, {"game", "turn", "board", "you"}]
    assert snake_names(path) == played.card.names
    (game,) = games_of(path)
    assert (game.settings, game.start.turn, game.steps, game.over_turn) == (played.settings, 0, [], None)


@pytest.mark.parametrize("form", ["log", "frames"])
def test_one_object_over_many_lines_is_read_as_on_one(played, tmp_path, form):
    value = FORMS[form](played)
    (tmp_path / "spread.json").write_text("\n\n" + json.dumps(value, indent=1) + "\n\n")
    assert values_in(tmp_path / "spread.json") == values_in(kept(tmp_path / "dense.json", value)) == [value]
    assert verify_file(tmp_path / "spread.json") == verify_file(tmp_path / "dense.json")


def test_a_file_may_be_as_large_as_the_limit_and_no_larger(played, tmp_path, monkeypatch):
    assert game_files.MAX_BYTES == 512 * 2**20
    path = kept(tmp_path / "game.json", *official(played))
    size = path.stat().st_size
    monkeypatch.setattr(game_files, "MAX_BYTES", size)
    assert verify_file(path).steps == played.turns
    monkeypatch.setattr(game_files, "MAX_BYTES", size - 1)
    with pytest.raises(InputFileError, match="more than 0 MB"):
        verify_file(path)


def test_a_file_that_cannot_be_read_says_why(tmp_path):
    with pytest.raises(InputFileError, match=r"cannot be read \(No such file or directory\)"):
        verify_file(tmp_path / "none.json")
    (tmp_path / "cut.json.gz").write_bytes(gzip.compress(b"{}" * 500)[:-12])
    with pytest.raises(InputFileError, match=r"cannot be read \(.*ended before"):
        verify_file(tmp_path / "cut.json.gz")


def test_empty_lines_are_passed_over_and_counted(played, tmp_path):
    lines = official(played)
    path = kept(tmp_path / "game.json", lines[0])
    path.write_text(path.read_text() + "\n  \n" + "".join(json.dumps(line) + "\n" for line in lines[1:]))
    assert verify_file(path).steps == played.turns
    path.write_text(path.read_text().replace(json.dumps(lines[1]), '"spoilt"'))
    with pytest.raises(InputFileError, match=r"game\.json:4: no JSON object"):
        verify_file(path)


def test_lines_before_the_first_turn_belong_to_the_game_they_come_before(played, tmp_path):
    first, *others = official(played)
    path = kept(tmp_path / "game.json", first, {"note": "a rainy day"}, {"note": "in May"}, *others)
    assert (verify_file(path).games, verify_file(path).steps) == (1, played.turns)
    two = kept(tmp_path / "two.json", first, *others, {"note": "the next one"}, *others)
    assert [game.line for game in games_of(two)] == [1, 1 + len(others) + 1]


def test_a_log_is_read_in_the_order_of_its_turns(played, tmp_path):
    log = snake_log(played)
    (ordered,) = games_of(kept(tmp_path / "log.json", log))
    log["moves"].reverse()
    (shuffled,) = games_of(kept(tmp_path / "shuffled.json", log))
    assert shuffled == ordered
    del log["end_request"]
    (cut,) = games_of(kept(tmp_path / "cut.json", log))
    assert cut.over_turn is None, "nobody told its end"


def test_events_may_end_without_an_end_or_name_the_game_in_it(played, tmp_path):
    first, *frames, end = events(played)
    (cut,) = games_of(kept(tmp_path / "cut.json", first, *frames))
    assert (cut.over_turn, len(cut.steps)) == (None, played.turns)
    for last in (end, {"Type": "game_end", "Data": {"game": first["Game"]}}):
        (whole,) = games_of(kept(tmp_path / "whole.json", *frames, last))
        assert (whole.over_turn, whole.settings) == (played.turns, played.settings)


def test_frames_of_a_running_game_are_not_over(played, tmp_path):
    frames = engine_frames(played)
    frames["Game"]["Status"] = "running"
    (game,) = games_of(kept(tmp_path / "frames.json", frames))
    assert (game.over_turn, len(game.steps)) == (None, played.turns)


def frames_of_one(**game):
    """One frame of a game of one snake on 7 x 5 squares, as little as the engine could tell."""
    snake = {"ID": "one", "Body": [{"X": 2, "Y": 3}, {"X": 2, "Y": 2}, {"X": 2, "Y": 2}], "Health": 90}
    first = {"Turn": 4, "Snakes": [snake], "Food": None, "Hazards": None}
    return {"Game": {"Width": 7, "Height": 5, **game}, "Frames": [first]}


@pytest.mark.parametrize(
    ("told", "ruleset", "map_name"),
    [
        ({}, "standard", "standard"),
        ({"RulesetName": "royale", "Map": "royale"}, "royale", "royale"),
        ({"Ruleset": {"name": "wrapped"}, "Map": "hz_columns"}, "wrapped", "hz_columns"),
        ({"RulesetName": "constrictor", "Ruleset": {"name": "standard"}, "Map": ""}, "constrictor", "standard"),
    ],
)
def test_one_frame_is_a_game_of_one_snake_by_the_rules_it_names(tmp_path, told, ruleset, map_name):
    (game,) = games_of(kept(tmp_path / "frames.json", frames_of_one(**told)))
    asked = GameSettings(width=7, height=5, players=1, ruleset=ruleset, map=map_name, solo=True)
    assert game.settings == asked
    (snake,) = game.start.snakes
    assert (game.start.turn, snake.id, snake.body, snake.health) == (4, "one", [(2, 3), (2, 2), (2, 2)], 90)
    assert (game.start.food, dict(game.start.hazards), game.steps) == ([], {}, [])


def test_frames_name_their_own_numbers(tmp_path):
    rules = {"foodSpawnChance": "20", "minimumFood": "3", "damagePerTurn": "9", "shrinkEveryNTurns": "11"}
    (game,) = games_of(kept(tmp_path / "frames.json", frames_of_one(Ruleset=rules)))
    told = game.settings
    assert (told.food_spawn_chance, told.minimum_food, told.hazard_damage, told.shrink_every) == (20, 3, 9, 11)
    frames = frames_of_one()
    frames["Frames"][0] |= {"Food": [{"X": 6, "Y": 4}], "Hazards": [{"X": 0, "Y": 1}] * 2}
    (game,) = games_of(kept(tmp_path / "frames.json", frames))
    assert (game.start.food, game.start.hazards) == ([(6, 4)], {(0, 1): 2})


def test_a_message_of_one_snake_alone_is_a_solo_game(tmp_path):
    alone, two = game_of(1, solo=True), game_of(2)
    for game, solo in ((alone, True), (two, None)):
        (read,) = games_of(kept(tmp_path / "game.json", *official(game)))
        assert read.settings.solo is solo


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda frame: frame.update(Food=[{"X": 7, "Y": 0}]), r"at \(7, 0\); expected squares of the board"),
        (lambda frame: frame["Snakes"][0].update(Health=101), "health 101; expected 0 to 100"),
        (lambda frame: frame["Snakes"][0].update(Death={"Cause": "boredom", "Turn": 3}), "cause 'boredom'; expected"),
    ],
)
def test_frames_that_cannot_be_are_refused_by_what_is_wrong(tmp_path, change, words):
    frames = frames_of_one()
    change(frames["Frames"][0])
    with pytest.raises(InputFileError, match=words):
        list(games_of(kept(tmp_path / "frames.json", frames)))


def test_a_turn_of_death_that_is_not_the_true_one_is_found(played, tmp_path):
    frames = engine_frames(played)
    for snake in (snake for one in frames["Frames"] for snake in one["Snakes"] if snake["Death"]):
        snake["Death"]["Turn"] += 1
    assert not verified(tmp_path / "frames.json", frames).agrees


def test_in_a_maze_all_turns_but_those_of_a_meal_are_held_to_the_rules(tmp_path):
    width, height = next(iter(MAPS["solo_maze"].sizes))
    lines = official(game_of(1, width=width, height=height, map="solo_maze", solo=True))
    report = verified(tmp_path / "maze.json", lines)
    assert report.agrees
    lines[4]["board"]["snakes"][0]["health"] -= 1
    assert not verified(tmp_path / "spoilt.json", lines).agrees

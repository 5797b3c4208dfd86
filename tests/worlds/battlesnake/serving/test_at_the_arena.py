"""A served snake at the official arena of 2026, as a stand-in of ours holds it: dead on the board, probes, misses."""

import json

import pytest
from tests.worlds.battlesnake.evaluation.test_game_files import verified
from tests.worlds.battlesnake.stand_in_arena import GAME_TYPES, Remote, Scripted, StandInArena

from racecraft.web.server import ServerThread
from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.imported import import_game, read_game
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.players.living_snakes import LivingSnakes
from racecraft.worlds.battlesnake.players.messages import read_message
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move
from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer

CRASHES = Scripted(lambda board, one: "left")
HUNGRY, SETTINGS = find_player("hungry"), GameSettings()


def careful(board, one):
    return HUNGRY.choose(board, SETTINGS, one, 0)


def careless(board, one):
    """Move safely most of the time, so that every way to die comes up."""
    turn = board.turn + int(one[-2:], 16)
    return MOVES[turn % 4] if turn % 7 == 0 else careful(board, one)


@pytest.fixture
def served():
    """Serve a player in a thread; returns (server, url)."""
    threads = []

    def serve(player="flood_fill", **options):
        server = SnakeServer(find_player(player) if isinstance(player, str) else player, **options)
        threads.append(ServerThread(server.application, "snake"))
        return server, f"http://127.0.0.1:{threads[-1].start('127.0.0.1', 0)}"

    yield serve
    for thread in threads:
        thread.close()


def test_our_snake_outlives_three_that_run_into_walls(served):
    server, url = served()
    others = {"b": CRASHES, "c": CRASHES, "d": Scripted(careful)}
    arena = StandInArena({"ours": Remote(url), **others}, seed=1).play(60)
    assert set(arena.statuses) == {200}
    assert (server.count.refused, server.count.failed, server.count.missed, arena.missed) == (0, 0, 0, 0)
    assert sum(snake.cause == "wall-collision" for snake in arena.referee.board.snakes) >= 2
    assert arena.referee.board.snakes[0].alive
    assert len(arena.statuses) > 30  # it played on for many turns after the first had died


@pytest.mark.parametrize("game_type", ["standard", "royale", "constrictor", "snail"])
def test_the_dead_are_told_from_the_living_on_every_board(game_type):
    """Each living snake reads the living of the referee, at every turn, whatever the others died of."""
    causes = set()
    for seed in range(12):
        arena = StandInArena({name: Scripted(careless) for name in "abcd"}, game_type, 7 if seed % 2 else 11, seed)
        readers = {one: LivingSnakes() for one in arena.ids}
        wrong = []

        def look(one, arena=arena, readers=readers, wrong=wrong):
            board = read_message(readers[one].only(arena.message(one))).board
            expected = arena.referee.board
            if [(s.id, s.body) for s in board.snakes] != [(s.id, s.body) for s in expected.alive()]:
                wrong.append((expected.turn, one))
            if board.hazards != expected.hazards:
                wrong.append((expected.turn, "hazards"))

        arena._move = lambda one, arena=arena, look=look: look(one) or careless(arena.referee.board, one)
        arena.play(150)
        assert wrong == []
        causes |= {snake.cause for snake in arena.referee.board.snakes}
    assert {"snake-self-collision", "head-collision"} <= causes


def test_a_server_begun_in_the_middle_of_a_game_goes_on(served):
    """It knows of no dead: those off the board are dropped, others are obstacles for a turn, nothing is refused."""
    arena = StandInArena({"ours": Scripted(careless), "b": CRASHES, "c": CRASHES, "d": Scripted(careless)}).play(14)
    assert any(not snake.alive for snake in arena.referee.board.snakes)
    server, url = served()
    for snake in arena.referee.board.alive():
        status, answer, _ = Remote(url).ask("/move", arena.message(snake.id))
        assert (status, answer["move"] in MOVES) == (200, True)
    assert server.count.refused == 0


def test_whoever_lies_under_our_head_is_dead():
    """Without memory of earlier turns: a body that would have ended us has not."""
    arena = StandInArena({"ours": CRASHES, "b": CRASHES, "c": CRASHES}).play(1)
    arena.referee.board.snakes[0].body = [(5, 5), (5, 4), (5, 3)]
    arena.referee.board.snakes[1].body = [(4, 5), (5, 5), (6, 5)]
    arena.referee.board.snakes[2].body = [(8, 8), (8, 9), (8, 10)]
    sent = arena.message(arena.ids[0])
    assert [snake.id for snake in read_message(LivingSnakes().only(sent)).board.snakes] == [arena.ids[0], arena.ids[2]]


ODD = {
    "no body": {"id": "odd", "health": 3},
    "no square": {"id": "odd", "health": 3, "body": ["here"]},
    "negative health": {"id": "odd", "health": -8, "body": [{"x": 0, "y": 0}]},
    "health of 900": {"id": "odd", "health": 900, "body": [{"x": 0, "y": 0}, {"x": 0, "y": 1}]},
    "no id": {"health": 9, "body": [{"x": 0, "y": 0}, {"x": 0, "y": 1}]},
    "off the board": {"id": "odd", "health": 9, "body": [{"x": -1, "y": 0}, {"x": 0, "y": 0}]},
    "no object": 7,
}


@pytest.mark.parametrize("how", ODD)
def test_another_snakes_oddity_is_never_an_error(served, how):
    server, url = served()
    arena = StandInArena({"ours": CRASHES, "b": CRASHES}).play(1)
    sent = arena.message(arena.ids[0])
    sent["board"]["snakes"] += [ODD[how], sent["board"]["snakes"][1], ODD[how]]
    sent["board"]["food"] += [{"x": 40, "y": 1}, None]
    status, answer, _ = Remote(url).ask("/move", sent)
    assert (status, answer["move"] in MOVES) == (200, True)
    living = read_message(LivingSnakes().only(sent)).board.snakes
    assert len(living) == 2 + (how in ("health of 900", "no id"))


def test_what_must_be_refused_still_holds_a_safe_move(served):
    _, url = served()
    arena = StandInArena({"ours": CRASHES, "b": CRASHES}).play(1)
    sent = arena.message(arena.ids[0])
    safe = best_safe_move(arena.referee.board, arena.settings, arena.ids[0])
    sent["game"]["ruleset"]["name"] = 7
    status, answer, _ = Remote(url).ask("/move", sent)
    assert (status, answer["error"], answer["move"]) == (422, "bad_board", safe)
    assert Remote(url).ask("/move", [])[1]["move"] in MOVES
    assert "move" not in Remote(url).ask("/start", [])[1]


def test_probes_are_answered_where_games_are_refused_and_are_no_games(served):
    server, url = served(most_games=1)
    arena = StandInArena({"ours": Remote(url), "b": Scripted(careless)}).play(3)
    refused = Remote(url).ask(
        "/start", StandInArena({"a": CRASHES, "b": CRASHES}, seed=5).play(0).message(arena.ids[0])
    )
    server._lag.lasting_seconds = 1e9
    assert (refused[0], arena.probe(url), server.games_open, server.count.games) == (503, True, 1, 1)


def test_a_game_that_is_tried_again_begins_anew(served):
    server, url = served()
    arena = StandInArena({"ours": Remote(url), "b": CRASHES, "c": Scripted(careful)})
    arena.play(5)
    arena.play(30)
    assert (set(arena.statuses), server.count.missed, server.count.games) == ({200}, 0, 1)


def test_answers_that_come_too_late_are_counted(served):
    """A player that does not keep to its time, at an arena that waits half a second: the server hears of its misses."""

    class Slow:
        quick = True

        def choose(self, board, settings, snake_id, seconds):
            if board.turn in (1, 2):
                import time

                time.sleep(0.65)
            return best_safe_move(board, settings, snake_id)

    server, url = served(Slow())
    arena = StandInArena({"ours": Remote(url), "b": Scripted(careless)}, seed=3).play(5)
    assert (arena.missed, server.count.missed) == (2, 2)


@pytest.mark.parametrize("game_type", GAME_TYPES)
@pytest.mark.parametrize("form", ["events", "pages", "details"])
def test_its_games_are_read_verified_and_shown(tmp_path, game_type, form):
    snakes = {name: Scripted(careless) for name in ("abc" if game_type != "solo" else "a")}
    arena = StandInArena(snakes, game_type, seed=2).play()
    told = {
        "events": [arena.details() | {"frames": []}, *arena.events()],
        "pages": [arena.details() | {"frames": []}, arena.game(), arena.page(100), arena.page(0)],
        "details": arena.details(),
    }[form]
    report = verified(tmp_path / "game.json", told)
    assert report.agrees, "\n".join(report.examples)
    assert report.steps == arena.referee.board.turn > 3
    found = import_game([tmp_path / "game.json"])
    assert (found.mismatches, found.played.over, found.played.card.id) == (0, True, arena.id)
    assert list(found.played.card.names.values()) == list(snakes)
    shown = read_game(tmp_path / "game.json")
    assert [s.cause for s in shown.boards[-1].snakes] == [s.cause for s in arena.referee.board.snakes]


def test_a_log_that_a_snake_kept_there_is_verified(tmp_path):
    arena = StandInArena({name: Scripted(careless) for name in "abcd"}, seed=4)
    kept = []
    choose = arena._move
    arena._move = lambda one: (
        (one == arena.ids[0] and kept.append(json.loads(json.dumps(arena.message(one))))) or choose(one)
    )
    arena.play()
    log = {"start_request": kept[0], "moves": [[one, {}] for one in kept], "end_request": arena.message(arena.ids[0])}
    report = verified(tmp_path / "log.json", log)
    assert report.agrees, "\n".join(report.examples)
    assert report.steps > 5

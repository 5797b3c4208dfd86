"""The arena: games, forfeits, tournaments, the official output file."""

import contextlib
import itertools
import json
import socket
import threading
import time
from dataclasses import asdict

import pytest

from racecraft.contract.errors import InputFileError
from racecraft.web.server import ServerThread
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.match import play
from racecraft.worlds.battlesnake.evaluation.record import read_record, write_record
from racecraft.worlds.battlesnake.evaluation.remote import Remote
from racecraft.worlds.battlesnake.evaluation.seats import Failures, Seat, take_seat
from racecraft.worlds.battlesnake.evaluation.tournament import Tournament, tournament
from racecraft.worlds.battlesnake.evaluation.tournament_file import TournamentFile
from racecraft.worlds.battlesnake.players.find import PLAYERS
from racecraft.worlds.battlesnake.players.from_file import load_file_player
from racecraft.worlds.battlesnake.players.protocol import PlayerError
from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer

SMALL = GameSettings(7, 7, 2)


def seats_of(*names):
    return [take_seat(name, f"{name}{number}", seed=number) for number, name in enumerate(names)]


def test_a_player_has_chosen_once_before_its_first_game(monkeypatch):
    class Counts:
        asked = 0

        def choose(self, board, settings, snake_id, seconds):
            self.asked += 1
            return "up"

    player = Counts()
    seats = "racecraft.worlds.battlesnake.evaluation.seats"
    monkeypatch.setattr(f"{seats}.find_player", lambda what, seed, memory_mb, is_isolated: player)
    assert take_seat("counts", "", 1).player is player
    assert player.asked == 1


def test_a_game_is_played_to_its_end_and_repeats_itself():
    games = [play(SMALL, seats_of("flood_fill", "random_safe"), StreamDice(5)) for _ in range(2)]
    assert games[0].boards == games[1].boards
    assert games[0].over
    assert len(games[0].boards[-1].alive()) <= 1
    assert [board.turn for board in games[0].boards] == list(range(games[0].turns + 1))
    assert sorted(games[0].places()) in ([0, 1], [0, 0])


def test_seats_and_snakes_must_agree():
    with pytest.raises(BoardError, match="1 seats for 2"):
        play(SMALL, seats_of("hungry"), StreamDice(1))


def test_the_output_file_has_the_official_shape_and_reads_back(tmp_path):
    seats = seats_of("flood_fill", "hungry")
    played = play(SMALL, seats, StreamDice(5))
    path = tmp_path / "game.jsonl"
    write_record(played, path)
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert set(lines[0]) == {"id", "ruleset", "map", "timeout", "source"}
    assert all(set(line) == {"game", "turn", "board", "you"} for line in lines[1:-1])
    assert set(lines[-1]) == {"winnerId", "winnerName", "isDraw", "eliminations"}
    assert [line["turn"] for line in lines[1:-1]] == list(range(played.turns + 1))
    again = read_record(path)
    assert again.boards == played.boards, "the dead too: our last line tells how they lie"
    assert again.card.names["s0"] == "flood_fill0"
    assert (again.winner, again.card.names) == (played.winner, played.card.names)


@pytest.mark.parametrize(
    "told",
    [
        3, [3], [{}], [{"id": []}], [{"id": "s1", "cause": "boredom", "body": [{"x": 1, "y": 1}], "health": 1}],
        [{"id": "s1", "cause": "hazard", "by": "", "turn": 1, "health": "many", "body": [{"x": 1, "y": 1}]}],
        [{"id": "s1", "cause": "hazard", "by": "", "turn": 1, "health": 1, "body": []}],
    ],
)  # fmt: skip
def test_a_last_line_that_tells_nonsense_of_the_dead_is_passed_over(tmp_path, told):
    played = play(SMALL, seats_of("flood_fill", "hungry"), StreamDice(5))
    path = tmp_path / "game.jsonl"
    write_record(played, path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:-1], json.dumps(json.loads(lines[-1]) | {"eliminations": told})]))
    again = read_record(path)
    assert [board.alive() for board in again.boards] == [board.alive() for board in played.boards]
    assert {snake.cause for snake in again.boards[-1].snakes} <= {"", "eliminated"}


@pytest.mark.parametrize(
    "text", ["", "{}\n", "{}\nno\n", '{}\n{"board": 1}\n', "[" * 5000, '{}\n{"board": {}, "game": []}']
)
def test_other_files_are_refused_by_name(tmp_path, text):
    path = tmp_path / "game.jsonl"
    path.write_text(text)
    with pytest.raises(InputFileError, match="game.jsonl"):
        read_record(path)


# Players that misbehave


def test_a_file_that_raises_hangs_or_lies_forfeits_by_the_official_rule(tmp_path):
    path = tmp_path / "rogue.py"
    path.write_text(
        "import time\n"
        "def move(data):\n"
        "    turn = data['turn']\n"
        "    if turn == 1: time.sleep(1.5)\n"
        "    return 'left' if turn == 0 else 1 / 0\n"
    )
    rogue = Seat("rogue", load_file_player(path))
    played = play(GameSettings(11, 11, 2), [rogue, *seats_of("random_safe")], StreamDice(3), timeout_ms=1000)
    rogue.leave()
    x, y = played.boards[0].snakes[0].head
    for turn in range(1, min(4, played.turns)):
        assert played.boards[turn].snakes[0].head == (x - turn, y), "the last move again"
    assert rogue.failures.timeouts >= 1


class FakeServer:
    """Answers /move with fixed bytes, or not at all; with status 299 a byte at a time."""

    def __init__(self, answer, then_close=False):
        self._answer, self._then_close, self._trickles = answer, then_close, answer.startswith(b"HTTP/1.1 299")
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        self._open = []
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return
            self._open.append(connection)
            threading.Thread(target=self._converse, args=(connection,), daemon=True).start()

    def _converse(self, connection):
        with connection, contextlib.suppress(OSError):  # one that came while the server closed, too
            while data := connection.recv(65536):
                if self._then_close:
                    return
                for byte in self._answer if self._trickles else b"":
                    connection.sendall(bytes([byte]))
                    time.sleep(0.02)
                if self._answer and not self._trickles and (b"/move" in data or b"/start" in data or b"/end" in data):
                    connection.sendall(self._answer)

    def close(self):
        for connection in self._open:
            connection.close()
        self._socket.close()


def http(body, status=200, length=None):
    body = body.encode()
    return f"HTTP/1.1 {status} X\r\nContent-Length: {length or len(body)}\r\n\r\n".encode() + body


ROGUES = {
    "hangs": (b"", False, "timeouts"),
    "dies": (b"", True, "crashes"),
    "lies": (http('{"move": "north"}'), False, "crashes"),
    "babbles": (http("hello"), False, "crashes"),
    "deep": (http("[" * 30000), False, "crashes"),
    "huge": (http('{"move": "up"}', length=10**9), False, "timeouts"),
    "errs": (http('{"move": "up"}', status=500), False, "crashes"),
    "trickles": (http('{"move": "left"}', status=299), False, "timeouts"),
    "no http": (b"SSH-2.0\r\n", False, "crashes"),
}


@pytest.mark.parametrize("how", ROGUES)
def test_a_rogue_server_forfeits_and_the_game_ends(how):
    answer, then_close, counted = ROGUES[how]
    server = FakeServer(answer, then_close)
    try:
        remote = Remote(f"http://127.0.0.1:{server.port}")
        rogue = Seat(how, remote)
        played = play(SMALL, [rogue, *seats_of("random_safe")], StreamDice(3), timeout_ms=60, most_turns=3)
    finally:
        rogue.leave()
        remote.close()
        server.close()
    heads = [board.snakes[0].head for board in played.boards if board.snakes[0].alive]
    assert all(b == (a[0], a[1] + 1) for a, b in zip(heads, heads[1:], strict=False)), "up, and up again"
    assert getattr(rogue.failures, counted) >= 1


@pytest.mark.parametrize("url", ["ftp://x", "http://", "http://h:99999", "http://[", "://"])
def test_addresses_that_are_none_are_refused(url):
    with pytest.raises(PlayerError, match="http://"):
        Remote(url)


def test_a_server_that_is_not_there_is_refused_at_set_up():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(PlayerError, match=str(port)):
        take_seat(f"http://127.0.0.1:{port}")


# Tournaments


def test_a_tournament_refuses_what_cannot_meet():
    seats = seats_of("hungry", "flood_fill")
    with pytest.raises(BoardError, match="every name once"):
        tournament([seats[0], seats[0]], SMALL)
    with pytest.raises(BoardError, match="3 snakes a game, but only 2 players; name at least 3"):
        tournament(seats, GameSettings(7, 7, 3))
    with pytest.raises(BoardError, match="2 snakes a game, but only 1 player; name at least 2"):
        tournament(seats[:1], SMALL)
    with pytest.raises(BoardError, match="1 snake a game; a tournament needs at least 2"):
        tournament(seats, GameSettings(7, 7, 1))


def test_a_tournament_goes_on_where_it_stopped_and_with_more_rounds(tmp_path):
    path = tmp_path / "games.jsonl"

    def held(rounds, most):
        seats = [take_seat("hungry"), take_seat("flood_fill")]
        kept = TournamentFile(path, [seat.name for seat in seats], SMALL, 100, 4, 1000)
        before = len(kept.games)
        going = Tournament(seats, SMALL, rounds, 100, seed=4, played=kept.games)
        for game, _ in itertools.islice(going.play(), most):
            kept.add(game)
        return before, going

    assert held(2, 3)[0] == 0
    path.write_bytes(path.read_bytes() + b'{"number": 4, "pla')  # cut off while it was written
    before, going = held(2, 99)
    assert (before, len(going.games)) == (3, 4)
    assert held(3, 99)[0] == 4
    at_once = tournament([take_seat("hungry"), take_seat("flood_fill")], SMALL, rounds=3, timeout_ms=100, seed=4)
    assert held(3, 99)[1].table() == at_once


def test_a_tournament_of_an_earlier_day_goes_on(tmp_path):
    """The lines as they were written by the version that first kept them."""
    path = tmp_path / "games.jsonl"
    head = {"tournament": 1, "players": ["a", "b"], "game": asdict(SMALL), "timeout_ms": 100, "seed": 4,
            "most_turns": 1000}  # fmt: skip
    game = '{"number":1,"players":[0,1],"places":[0,1],"turns":87,"timeouts":[0,2],"crashes":[0,0]}'
    path.write_text(f"{json.dumps(head)}\n{game}\n")
    (read,) = TournamentFile(path, ["a", "b"], SMALL, 100, 4, 1000).games
    assert (read.players, read.places, read.turns, read.timeouts) == ((0, 1), (0, 1), 87, (0, 2))


class Thinker:
    """Notes how long it may think."""

    def __init__(self):
        self.told = []

    def choose(self, board, settings, snake_id, seconds):
        self.told.append(seconds)
        return "up"


@pytest.mark.parametrize(("timeout_ms", "seconds"), [(500, 0.8 * 0.4), (100, 0.8 * 0.05)])
def test_a_player_thinks_as_long_beside_the_board_as_behind_a_server_of_ours(timeout_ms, seconds):
    """500 ms less 100 for the way, of 100 ms half; four fifths of that to think. Who has no way keeps its time, too."""
    here, there = Thinker(), Thinker()
    play(SMALL, [Seat("here", here), Seat("too", here)], StreamDice(1), timeout_ms=timeout_ms, most_turns=2)
    assert here.told == [pytest.approx(seconds)] * 4

    thread = ServerThread(SnakeServer(there, threads=1).application, "snake")
    seat = take_seat(f"http://127.0.0.1:{thread.start('127.0.0.1', 0)}")
    try:
        play(SMALL, [seat, take_seat("hungry")], StreamDice(1), "g", timeout_ms, most_turns=6)
    finally:
        seat.leave()
        thread.close()
    assert max(there.told) <= seconds
    assert max(there.told) > 0.5 * seconds, "less only what reading the request took, at its quickest"


def test_of_failures_without_end_the_first_thousand_turns_are_kept():
    failures = Failures()
    for turn in range(1200):
        failures.note_late(turn, "late")
        failures.note_crash(turn, "crashed")
    assert (failures.timeouts, failures.crashes) == (1200, 1200)
    assert failures.late_turns == failures.failed_turns == [*range(1000)]


def in_order(names, rounds):
    seats = [take_seat(name) for name in names]
    for seat in seats:
        if seat.name == "search":
            seat.player.most_walks = 300
    table = tournament(seats, GameSettings(11, 11, 2), rounds=rounds, seed=2, timeout_ms=2000)
    return [line.name for line in table.standings][::-1], table


def test_the_players_rise_in_strength():
    order, table = in_order(list(PLAYERS), rounds=2)
    assert order == list(PLAYERS)
    assert all(line.timeouts == line.crashes == 0 for line in table.standings)


@pytest.mark.long
def test_every_player_beats_the_one_before_it_surely():
    for weaker, stronger in zip(PLAYERS, list(PLAYERS)[1:], strict=False):
        _, table = in_order([weaker, stronger], rounds=50)
        best = table.standings[0]
        assert (best.name, best.win_rate_low > 0.5) == (stronger, True), table

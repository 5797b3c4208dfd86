"""The arena: games, forfeits, ratings, tournaments, the official output file."""

import contextlib
import itertools
import json
import math
import socket
import threading
import time
from dataclasses import asdict

import pytest

from racecraft.contract.errors import InputFileError
from racecraft.evaluation.rating import Result, rate
from racecraft.web.server import ServerThread
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.match import play
from racecraft.worlds.battlesnake.evaluation.record import read_record, write_record
from racecraft.worlds.battlesnake.evaluation.remote import Remote
from racecraft.worlds.battlesnake.evaluation.seats import Failures, Seat, take_seat
from racecraft.worlds.battlesnake.evaluation.standings import GameResult, table_of
from racecraft.worlds.battlesnake.evaluation.tournament import Tournament, tournament
from racecraft.worlds.battlesnake.evaluation.tournament_file import TournamentFile
from racecraft.worlds.battlesnake.players.find import PLAYERS
from racecraft.worlds.battlesnake.players.from_file import load_file_player
from racecraft.worlds.battlesnake.players.protocol import LatePlayerError, PlayerError
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move
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


def test_who_names_no_time_gives_the_half_second_of_the_official_engine():
    seats, told = seats_of("flood_fill", "random_safe"), []
    _, first = next(Tournament(seats, SMALL).play())
    tournament(seats, SMALL, on_game=lambda played, number, count: told.append(played))
    assert {played.card.timeout_ms for played in (first, play(SMALL, seats, StreamDice(5)), *told)} == {500}


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
    "lists": (http("[]"), False, "crashes"),
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


def test_a_server_that_never_finishes_its_answer_is_late_and_no_liar():
    server = FakeServer(http('{"move": "up"}', length=10**9))
    remote = Remote(f"http://127.0.0.1:{server.port}")
    with pytest.raises(LatePlayerError, match=r"no answer within 0\.05 s") as told:
        remote.move({}, 0.05)
    assert isinstance(told.value, TimeoutError), "so that it counts among the timeouts"
    remote.close()
    server.close()


@pytest.mark.parametrize("url", ["ftp://x", "http://", "http://h:99999", "http://[", "://"])
def test_addresses_that_are_none_are_refused(url):
    with pytest.raises(PlayerError, match="http://"):
        Remote(url)


def test_a_server_that_is_not_there_is_refused_at_set_up():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(PlayerError, match=str(port)):
        take_seat(f"http://127.0.0.1:{port}")


# Ratings


def test_ten_games_of_eleven_are_400_points():
    won, lost = Result((0, 1), (0, 1)), Result((0, 1), (1, 0))
    best, other = rate(2, [won] * 10_000 + [lost] * 1_000)
    assert best.points - other.points == pytest.approx(400.0, abs=0.3)


def test_ratings_find_the_strengths_the_results_came_from():
    # 10 to 1 is 400 points; a mean of 1500.
    results = [Result((0, 1), (0, 1))] * 1000 + [Result((1, 0), (0, 1))] * 100
    strong, weak = rate(2, results)
    assert strong.points - weak.points == pytest.approx(400, abs=5)
    assert strong.points + weak.points == pytest.approx(3000)
    assert strong.low < strong.points < strong.high
    # With two players the difference has the spread of its log odds: sqrt(1/1000 + 1/100).
    half = 1.96 * math.sqrt(1 / 1000 + 1 / 100) * 400 / math.log(10) / 2
    assert strong.high - strong.points == pytest.approx(half, rel=0.02)


def test_ratings_are_finite_and_narrow_with_more_games():
    few, many = (rate(3, [Result((0, 1, 2), (0, 1, 1))] * n) for n in (2, 200))
    assert many[1].points == pytest.approx(many[2].points)
    assert few[0].points < many[0].points < 4000
    assert many[1].high - many[1].low < few[1].high - few[1].low


# Tournaments


def test_a_tournament_swaps_seats_with_the_same_dice():
    starts = []
    seats = seats_of("random_safe", "hungry", "flood_fill")
    told = lambda played, number, games: starts.append((number, games, played.boards[0], played.card.names))  # noqa: E731
    table = tournament(seats, SMALL, rounds=1, on_game=told, seed=4)
    assert table.games == 6
    assert len(starts) == 6
    for first, second in zip(starts[::2], starts[1::2], strict=True):
        assert first[2] == second[2], "the same start"
        assert list(first[3].values()) == list(second[3].values())[::-1], "the other way round"
    assert sum(line.games for line in table.standings) == 12
    json.dumps(table.to_dict())


def test_a_tournament_of_which_nothing_is_said_is_one_round_of_a_thousand_turns_and_half_seconds():
    seats = seats_of("random_safe", "hungry", "flood_fill")
    plain = Tournament(seats, SMALL)
    assert plain.planned == 6, "three pairs, each seat once"
    assert (plain._timeout_ms, plain._most_turns) == (500, 1000)


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


def result(number, players, places):
    return GameResult(number, players, places, 10 * number, (0,) * len(players), (1,) + (0,) * (len(players) - 1))


def test_head_to_head_counts_won_drawn_and_lost_of_every_pair():
    games = [result(1, (0, 1, 2), (0, 1, 1)), result(2, (2, 0), (0, 1)), result(3, (0, 1), (1, 0))]
    table = table_of(["a", "b", "c", "d"], games, planned=5)
    scores = {(a, b): str(score) for a, row in table.head_to_head.items() for b, score in row.items()}
    assert scores == {
        ("a", "b"): "1-0-1", ("b", "a"): "1-0-1", ("a", "c"): "1-0-1", ("c", "a"): "1-0-1",
        ("b", "c"): "0-1-0", ("c", "b"): "0-1-0",
    }  # fmt: skip
    assert (table.games, table.games_planned, table.turns) == (3, 5, 60)
    by_name = {line.name: line for line in table.standings}
    assert (by_name["a"].games, by_name["a"].wins, by_name["a"].crashes) == (3, 1, 2)
    assert (by_name["d"].games, by_name["d"].wins) == (0, 0)


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


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: "", "no line"),
        (lambda text: "{}\n", "games.jsonl:1|line 1"),
        (lambda text: text.replace('"hungry"', '"angry"'), "another tournament.*angry.*hungry"),
        (lambda text: text.replace('"seed":4', '"seed":5'), "seed 5, now 4"),
        (lambda text: text + "no\n", "games.jsonl:2|line 2"),
        (lambda text: text + '{"number":2,"players":[0,1],"places":[0,1],"turns":1,"timeouts":[0,0],"crashes":[0,0]}\n',
         "game 2 where game 1 belongs"),
        (lambda text: text + '{"number":1,"players":[0,7],"places":[0,1],"turns":1,"timeouts":[0,0],"crashes":[0,0]}\n',
         "of 2"),
    ],
)  # fmt: skip
def test_another_file_is_not_gone_on_with(tmp_path, change, words):
    path = tmp_path / "games.jsonl"
    asked = (path, ["hungry", "flood_fill"], SMALL, 100, 4, 1000)
    TournamentFile(*asked)
    path.write_text(change(path.read_text()))
    before = path.read_bytes()
    with pytest.raises(InputFileError, match=words):
        TournamentFile(*asked)
    assert path.read_bytes() == before


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


@pytest.mark.parametrize("sequential", [False, True])
def test_a_player_that_reads_messages_plays_asked_one_by_one_or_all_at_once(sequential):
    class Leftwards:
        name = "leftwards"

        def move(self, message, seconds):
            return "left"

        def start(self, message, seconds):
            pass

        end = start

    played = play(
        GameSettings(7, 7, 2), [Seat("leftwards", Leftwards()), *seats_of("random_safe")], StreamDice(3),
        timeout_ms=1000, sequential=sequential, most_turns=2,
    )  # fmt: skip
    begins, later = (board.snakes[0].head for board in (played.boards[0], played.boards[1]))
    assert later == (begins[0] - 1, begins[1])


def test_of_failures_without_end_the_first_thousand_turns_are_kept():
    failures = Failures()
    for turn in range(1200):
        failures.note_late(turn, "late")
        failures.note_crash(turn, "crashed")
    assert (failures.timeouts, failures.crashes) == (1200, 1200)
    assert failures.late_turns == failures.failed_turns == [*range(1000)]


def test_who_fails_is_told_with_its_turns():
    class Moody:
        def choose(self, board, settings, snake_id, seconds):
            if board.turn == 1:
                raise PlayerError("no mood.")
            if board.turn == 2:
                time.sleep(1.2)
            return best_safe_move(board, settings, snake_id)

    moody = Seat("moody", Moody())
    play(GameSettings(11, 11, 2), [moody, *seats_of("random_safe")], StreamDice(3), timeout_ms=1000, most_turns=4)
    failures = moody.failures
    assert (failures.failed_turns, failures.late_turns) == ([1], [2])
    assert (failures.crashes, failures.timeouts) == (1, 1)
    assert failures.last_error.startswith("turn 2: moody: no answer within")


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


def test_a_server_that_does_not_answer_a_start_is_hung_up_on():
    class Deaf(Remote):
        def __init__(self):
            self.hung_up, self.woken = 0, threading.Event()

        def start(self, message, seconds):
            self.woken.wait(60)

        def disconnect(self):
            self.hung_up += 1

    deaf = Deaf()
    Seat("deaf", deaf).notify("start", {}, 0.01)
    deaf.woken.set()
    assert deaf.hung_up == 1

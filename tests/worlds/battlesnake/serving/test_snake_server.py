"""A snake over HTTP: the official API, many games at once, never late, and nothing that takes it down."""

import asyncio
import gc
import json
import os
import sys
import threading
import time

import pytest

from racecraft.serving.loop_lag import LoopLag
from racecraft.serving.quick_answers import answer_before_thinking, freeze_loaded
from racecraft.web.server import ServerThread
from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.state import Games
from racecraft.worlds.battlesnake.evaluation.match import play
from racecraft.worlds.battlesnake.evaluation.seats import take_seat
from racecraft.worlds.battlesnake.players.find import find_player, warm_up
from racecraft.worlds.battlesnake.players.from_file import load_file_player
from racecraft.worlds.battlesnake.players.messages import GameCard, message
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move, safe_moves
from racecraft.worlds.battlesnake.serving import snake_server
from racecraft.worlds.battlesnake.serving.admission import Admission
from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer


def letter(game_id="g", timeout_ms=3000, you="s0"):
    referee = Referee(GameSettings(7, 7, 2), StreamDice(2))
    return message(referee.board, referee.settings, you, GameCard(game_id, timeout_ms)), referee


async def exchange(port, raw, cut=False):
    """Send bytes; return status and JSON of the answer, (0, None) where the server closed without one."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        writer.write(raw)
        await writer.drain()
        if cut:
            writer.write_eof()
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), 5)
        length = int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0])
        return int(head.split()[1]), json.loads(await reader.readexactly(length))
    except (asyncio.IncompleteReadError, ConnectionError):
        return 0, None
    finally:
        writer.close()


def post(path, value, length=None):
    body = value if isinstance(value, bytes) else json.dumps(value).encode()
    size = len(body) if length is None else length
    return f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Length: {size}\r\n\r\n".encode() + body


def serving(server, talk):
    """Run `talk(port)` against a server."""
    thread = ServerThread(server.application, "snake")
    port = thread.start("127.0.0.1", 0)
    try:
        return asyncio.run(asyncio.wait_for(talk(port), 60))
    finally:
        thread.close()
        server.close()


def test_the_official_way_through_a_game():
    server = SnakeServer(find_player("flood_fill"), {"color": "#00aaff"}, author="me")
    sent, referee = letter()

    async def talk(port):
        index = await exchange(port, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        start = await exchange(port, post("/start", sent))
        after_start = server.games_open
        move = await exchange(port, post("/move", sent))
        end = await exchange(port, post("/end", sent))
        return index, start, after_start, move, end

    index, start, after_start, move, end = serving(server, talk)
    wanted = {"apiversion": "1", "author": "me", "color": "#00aaff", "head": "default", "tail": "default"}
    assert index == (200, wanted | {"version": "racecraft"})
    assert (start, end) == ((200, {}), (200, {}))
    assert move[0] == 200
    assert move[1]["move"] in safe_moves(referee.board, referee.settings, "s0")
    assert (after_start, server.games_open) == (1, 0)
    assert (server.count.games, server.count.moves, server.count.late, server.count.refused) == (1, 1, 0, 0)


GOOD = json.dumps(letter()[0]).encode()
NO_YOU = json.dumps(letter()[0] | {"you": {"id": "ghost"}}).encode()
GOOD_POST = post("/move", GOOD)
BAD_REQUESTS = {
    "no http": (b"\x16\x03\x01\x02\x00\n", 400, "bad_request"),
    "long line": (b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n", 431, "headers_too_large"),
    "other page": (b"GET /favicon.ico HTTP/1.1\r\n\r\n", 404, "no_such_page"),
    "other method": (b"GET /move HTTP/1.1\r\n\r\n", 405, "wrong_method"),
    "no body": (b"POST /move HTTP/1.1\r\nHost: x\r\n\r\n", 400, "bad_json"),
    "packed": (GOOD_POST.replace(b"Host: x", b"Content-Encoding: gzip"), 415, "content_encoding"),
    "huge": (post("/move", b"", 2**20 + 1), 413, "body_too_large"),
    "huge, and sent all the same": (post("/move", b"[" * (2**20 * 3)), 413, "body_too_large"),
    "two lengths": (GOOD_POST.replace(b"Host: x", b"Content-Length: 5"), 400, "bad_request"),
    "empty": (post("/move", b""), 400, "bad_json"),
    "no json": (post("/move", b"hello"), 400, "bad_json"),
    "no utf-8": (post("/move", b'"\xff\xfe"'), 400, "bad_json"),
    "deep": (post("/move", b"[" * 200_000), 400, "bad_json"),
    "huge number": (post("/move", b'{"turn": ' + b"9" * 5000 + b"}"), 400, "bad_json"),
    "a list": (post("/move", b"[]"), 422, "bad_board"),
    "nothing in it": (post("/start", b"{}"), 422, "bad_board"),
    "not on the board": (post("/move", NO_YOU), 422, "bad_board"),
}


def test_bad_requests_get_named_errors_and_the_server_goes_on():
    async def talk(port):
        return {
            how: [await exchange(port, each) for each in (raw, GOOD_POST)] for how, (raw, *_) in BAD_REQUESTS.items()
        }

    answers = serving(SnakeServer(find_player("hungry")), talk)
    found = {how: (bad[0], bad[1] and bad[1]["error"], good[0]) for how, (bad, good) in answers.items()}
    assert found == {how: (status, name, 200) for how, (_, status, name) in BAD_REQUESTS.items()}


def test_a_body_that_is_cut_is_dropped_and_the_server_goes_on():
    server = SnakeServer(find_player("hungry"))

    async def talk(port):
        cut = await exchange(port, post("/move", GOOD, len(GOOD) + 50), cut=True)
        return cut, await exchange(port, post("/move", GOOD))

    cut, good = serving(server, talk)
    assert cut == (0, None)
    assert good[0] == 200


def test_more_connections_than_there_is_room_for_are_sent_away(monkeypatch):
    monkeypatch.setattr("racecraft.web.limits.MAX_CONNECTIONS", 1)
    server = SnakeServer(find_player("hungry"))

    async def talk(port):
        _, first = await asyncio.open_connection("127.0.0.1", port)
        await asyncio.sleep(0.05)
        second = await exchange(port, post("/move", GOOD))
        first.close()
        third = second
        while third[0] == 503:  # until the server has seen the first one go
            third = await exchange(port, post("/move", GOOD))
        return second, third

    second, third = serving(server, talk)
    assert (second[0], second[1]["error"]) == (503, "too_many_connections")
    assert third[0] == 200


class Rogue:
    """A player that hangs, raises, or answers nonsense."""

    def __init__(self, how):
        self.how, self.gate = how, threading.Event()

    def choose(self, board, settings, snake_id, seconds):
        if self.how == "hangs":
            self.gate.wait(120)
        if self.how == "raises":
            raise SystemExit("enough")
        return "north"


@pytest.mark.parametrize(("how", "late", "failed"), [("hangs", 3, 0), ("raises", 0, 3), ("lies", 0, 3)])
def test_a_player_that_fails_still_gets_a_safe_move_out_in_time(how, late, failed):
    player = Rogue(how)
    server = SnakeServer(player, threads=1, margin_ms=800)  # half is thought, half is the machine's to lose
    sent, referee = letter(timeout_ms=1600)
    seconds = []

    async def talk(port):
        words = []
        for _ in range(3):
            begin = time.monotonic()
            words.append((await exchange(port, post("/move", sent)))[1]["move"])
            seconds.append(time.monotonic() - begin)
        return words

    words = serving(server, talk)
    player.gate.set()
    assert set(words) <= set(safe_moves(referee.board, referee.settings, "s0"))
    assert max(seconds) < 1.6
    assert (server.count.late, server.count.failed) == (late, failed)


class Quick:
    """A player that has its answer in a blink, and remembers in which thread it was asked."""

    quick = True

    def __init__(self):
        self.asked_in = []

    def choose(self, board, settings, snake_id, seconds):
        self.asked_in.append(threading.current_thread())
        return max(safe_moves(board, settings, snake_id))


def test_a_quick_player_is_asked_on_the_spot_and_where_time_is_up_not_at_all(monkeypatch):
    player, (sent, referee) = Quick(), letter(timeout_ms=10_000)
    server = SnakeServer(player)

    async def talk(port):
        first = await exchange(port, post("/move", sent))
        monkeypatch.setattr("racecraft.worlds.battlesnake.serving.snake_server.MAX_LAG_SHARE", 1.0)
        server._lag.note(1e9)  # the request is thought to have waited for as long as there was
        return first, await exchange(port, post("/move", sent))

    first, second = serving(server, talk)
    assert [thread.name for thread in player.asked_in] == ["snake"]
    assert first == (200, {"move": max(safe_moves(referee.board, referee.settings, "s0"))})
    assert second == (200, {"move": best_safe_move(referee.board, referee.settings, "s0")})
    assert (server.count.moves, server.count.late) == (2, 1)


def test_what_a_request_waited_before_it_was_read_is_taken_off_its_time_up_to_a_half(monkeypatch):
    given = []

    async def wait(act, seconds):
        given.append(seconds)
        return "up"

    server = SnakeServer(Rogue("lies"))
    monkeypatch.setattr(server, "_wait", wait)
    monkeypatch.setattr("racecraft.serving.loop_lag.FADING", 1.0)
    sent, _ = letter(timeout_ms=100_000)

    async def talk(port):
        for lag in (10.0, 1e9):
            server._lag.note(lag)
            await exchange(port, post("/move", sent))

    serving(server, talk)
    for seconds, expected in zip(given, (99.9 - 10, 99.9 / 2), strict=True):
        assert expected - 9 < seconds <= expected  # what it took to come here went off, too


def test_where_requests_lastingly_wait_to_be_read_no_game_more_is_taken():
    said = []
    server = SnakeServer(find_player("hungry"), complain=said.append)

    async def talk(port):
        async def ask(path, game):
            return (await exchange(port, post(path, letter(game, timeout_ms=500)[0])))[0]

        server._lag.lasting_seconds = 1e9
        alone = await ask("/start", "g0")
        server._lag.lasting_seconds = 1e9
        crowded = [
            await ask("/start", "g1"),
            await ask("/move", "g2"),
            await ask("/move", "g0"),
            await ask("/end", "g9"),
        ]
        server._lag.lasting_seconds = 0.01
        return alone, crowded, await ask("/start", "g1")

    assert serving(server, talk) == (200, [503, 503, 200, 200], 200)
    assert "so busy" in said[0]


def test_of_a_burst_of_starts_so_many_are_taken_as_can_be_answered_in_time(monkeypatch):
    """Reading a message takes 4 ms here, so that a hundred games at once could never be answered within 400."""
    slow = snake_server.read_message
    monkeypatch.setattr(snake_server, "read_message", lambda message: (time.sleep(0.004), slow(message))[1])
    server, said, late = SnakeServer(find_player("hungry"), complain=lambda sentence: said.append(sentence)), [], []

    async def client(port, number):
        sent = letter(f"g{number}", timeout_ms=500)[0]
        status, answer = await exchange(port, post("/start", sent))
        if status == 503:
            return answer["error"]
        await exchange(port, post("/move", sent))  # while the other starts are read, which takes what it takes
        for _ in range(3):
            begin = time.monotonic()
            await exchange(port, post("/move", sent))
            late.append(time.monotonic() - begin > 0.5)
        return "taken"

    async def talk(port):
        return await asyncio.gather(*(client(port, number) for number in range(100)))

    answers = serving(server, talk)
    assert set(answers) == {"taken", "too_busy"}
    assert len(late) == 3 * answers.count("taken") > 0
    assert sum(late) <= len(late) // 10
    assert "so busy" in said[0]


def test_while_moves_are_late_no_game_more_is_taken():
    admission = Admission(LoopLag())
    for _ in range(10):
        admission.note_move(taken=0.5, allowed=0.4)
    assert admission.is_too_busy(waited=0.0, allowed=0.4)
    for _ in range(100):
        admission.note_move(taken=0.3, allowed=0.4)
    assert not admission.is_too_busy(waited=0.0, allowed=0.4)
    assert admission.is_too_busy(waited=0.1, allowed=0.4)


def test_boards_that_kernels_cannot_tell_are_answered_all_the_same():
    assert Games  # the arrays refuse living snakes that overlap, and bodies of one square
    sent, _ = letter()
    sent["board"]["snakes"][0]["body"] = sent["board"]["snakes"][1]["body"]
    short, _ = letter()
    short["board"]["snakes"][0]["body"] = short["board"]["snakes"][0]["body"][:1]
    server = SnakeServer(find_player("search"))

    async def talk(port):
        return [await exchange(port, post("/move", each)) for each in (sent, short)]

    answers = serving(server, talk)
    assert all(status == 200 and answer["move"] in MOVES for status, answer in answers)


def test_silent_games_are_forgotten_and_games_beyond_the_cap_are_refused_until_one_ends_or_is_abandoned():
    now, said = [0.0], []
    server = SnakeServer(
        find_player("hungry"), silence_seconds=600, most_games=3, clock=lambda: now[0], complain=said.append
    )

    async def talk(port):
        async def ask(path, game):
            return (await exchange(port, post(path, letter(game)[0])))[0]

        begun = [await ask("/start", f"g{number}") for number in range(5)]
        moves = [await ask("/move", "g0"), await ask("/move", "g4")]
        after_an_end = [await ask("/end", "g1"), await ask("/start", "g4")]
        now[0] = 29
        early = await ask("/start", "g5")
        now[0] = 31
        late = await ask("/start", "g5")
        many = server.games_open
        now[0] = 700
        return begun, moves, after_an_end, early, late, many, server.games_open

    assert serving(server, talk) == ([200, 200, 200, 503, 503], [200, 503], [200, 200], 503, 200, 3, 0)
    assert server.count.refused == 4
    assert "beyond 3 at once" in said[0]


def test_many_games_at_once_are_answered_in_time():
    """Fifty clients on connections that stay open, a searching player, two threads; slack for a crowded machine."""
    server = SnakeServer(find_player("search"), threads=2, margin_ms=1500)
    find_player("search").choose(letter()[1].board, GameSettings(7, 7, 2), "s0", 0)
    late = []

    async def client(port, number):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for _ in range(3):
            sent, _ = letter(f"g{number}", timeout_ms=3000)
            begin = time.monotonic()
            writer.write(post("/move", sent))
            head = await reader.readuntil(b"\r\n\r\n")
            body = await reader.readexactly(int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0]))
            late.append(time.monotonic() - begin > 3.0)
            assert json.loads(body)["move"] in MOVES
            await asyncio.sleep(0.05)
        writer.close()

    async def talk(port):
        await asyncio.gather(*(client(port, number) for number in range(50)))

    serving(server, talk)
    assert (sum(late), server.count.moves + server.count.refused) == (0, 150)
    assert server.count.moves >= 100  # a crowded machine turns some games away, with a move
    assert server.count.p99_ms() < 3000


def game_told(number, turns):
    """Return the requests of one game of four: its start, and a move for each of some turns."""
    settings, referee = GameSettings(11, 11, 4), Referee(GameSettings(11, 11, 4), StreamDice(number))
    told = [post("/start", message(referee.board, settings, "s0", GameCard(f"g{number}", 500)))]
    for _ in range(turns):
        told.append(post("/move", message(referee.board, settings, "s0", GameCard(f"g{number}", 500))))
        board = referee.board
        referee.turn({snake.id: best_safe_move(board, settings, snake.id) for snake in board.alive()})
    return told


@pytest.mark.long
def test_search_is_never_late_in_many_games_of_four():
    """Twenty-four clients at the official timeout, each asking again after every answer, on two threads."""
    player = find_player("search")
    warm_up(player)
    player.minds.ponders = True
    server, games = SnakeServer(player, threads=2), [game_told(number, 8) for number in range(24)]
    taken, all_began = [], asyncio.Barrier(24)

    async def client(port, requests):
        await exchange(port, requests[0])
        await all_began.wait()
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for request in requests[1:]:
            begin = time.monotonic()
            writer.write(request)
            head = await reader.readuntil(b"\r\n\r\n")
            await reader.readexactly(int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0]))
            taken.append(time.monotonic() - begin)
        writer.close()

    async def talk(port):
        await asyncio.gather(*(client(port, requests) for requests in games))

    answer_before_thinking()
    serving(server, talk)
    assert len(taken) == 24 * 8
    crowded = os.getloadavg()[0] > (os.cpu_count() or 1)  # other programs want the cores: a few may be late then
    assert server.count.failed == 0
    assert server.count.late <= len(taken) // 20 * crowded
    assert sum(one > 0.5 for one in taken) == 0


def test_a_served_file_plays_in_the_arena_and_hears_start_and_end(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        "from pathlib import Path\n"
        "heard = []\n"
        "def info():\n    return {'color': '#123456'}\n"
        "def start(data):\n    heard.append('start')\n"
        "def end(data):\n    Path(__file__).with_suffix('.txt').write_text(' '.join([*heard, 'end']))\n"
        "def move(data):\n    heard.append(data['you']['id'])\n    return {'move': 'up'}\n"
    )
    player = load_file_player(path)
    server = SnakeServer(player, player.appearance())

    async def talk(port):
        def meet():
            seats = [take_seat(f"http://127.0.0.1:{port}", "mine"), take_seat("flood_fill")]
            played = play(GameSettings(7, 7, 2), seats, StreamDice(1), "g", most_turns=2)
            seats[0].leave()
            return seats[0], played

        return await asyncio.to_thread(meet)

    seat, played = serving(server, talk)
    player.close()
    assert seat.appearance["color"] == "#123456"
    assert (seat.failures.timeouts, seat.failures.crashes) == (0, 0)
    assert path.with_suffix(".txt").read_text() == "start s0 s0 end"
    assert played.boards[1].snakes[0].head[1] == played.boards[0].snakes[0].head[1] + 1


def test_a_file_that_hangs_while_served_costs_no_safe_move(tmp_path):
    (tmp_path / "mine.py").write_text("def move(data):\n    while True: pass\n")
    player = load_file_player(tmp_path / "mine.py")
    server = SnakeServer(player, margin_ms=100)
    sent, referee = letter(timeout_ms=200)

    async def talk(port):
        return [await exchange(port, post("/move", sent)) for _ in range(3)]

    answers = serving(server, talk)
    player.close()
    assert {answer["move"] for _, answer in answers} <= set(safe_moves(referee.board, referee.settings, "s0"))
    assert server.count.late == 3
    assert max(server.count.latencies_ms) < 2000


class ManyBoards:
    """Answers for many boards at once, and notes how many came together."""

    def __init__(self, how="", seconds=0.02):
        self.how, self.seconds, self.sizes = how, seconds, []

    def choose(self, board, settings, snake_id, seconds):
        raise AssertionError("the server asks for many")

    def choose_many(self, questions):
        self.sizes.append(len(questions))
        if self.how == "hangs" and len(self.sizes) == 1:
            threading.Event().wait(3)
        if self.how == "raises":
            raise ValueError("no forward pass today")
        time.sleep(self.seconds)
        moves = [safe_moves(one.board, one.settings, one.snake_id)[0] for one in questions]
        return moves[1:] if self.how == "miscounts" else ["north"] * len(moves) if self.how == "lies" else moves


def many_clients(server, clients, moves, timeout_ms=5000):
    """Let clients with snakes of their own ask at the same time; return every answer."""

    async def client(port, number):
        sent, _ = letter(f"g{number}", timeout_ms, you=f"s{number % 2}")
        return [(number % 2, await exchange(port, post("/move", sent))) for _ in range(moves)]

    async def talk(port):
        return [one for each in await asyncio.gather(*(client(port, n) for n in range(clients))) for one in each]

    return serving(server, talk)


def test_boards_that_wait_together_are_thought_about_together():
    player = ManyBoards(seconds=0.1)
    answers = many_clients(SnakeServer(player), clients=40, moves=3)
    _, referee = letter()
    for snake, (status, answer) in answers:
        assert status == 200
        assert answer["move"] == safe_moves(referee.board, referee.settings, f"s{snake}")[0], "everyone gets its own"
    assert sum(player.sizes) == 120
    assert len(player.sizes) < 40, "a batch gathers while the one before it is thought about"


@pytest.mark.parametrize("how", ["raises", "miscounts", "lies"])
def test_a_player_of_many_boards_that_fails_still_gets_safe_moves_out(how):
    said = []
    server = SnakeServer(ManyBoards(how), complain=said.append)
    answers = many_clients(server, clients=3, moves=2)
    _, referee = letter()
    for snake, (_, answer) in answers:
        assert answer["move"] in safe_moves(referee.board, referee.settings, f"s{snake}")
    assert server.count.failed == 6
    assert all(said)


def test_a_batch_that_hangs_is_given_up(monkeypatch):
    monkeypatch.setattr("racecraft.serving.batching_queue.HANGING_SECONDS", 0.2)
    server = SnakeServer(ManyBoards("hangs"), margin_ms=1000)
    answers = many_clients(server, clients=2, moves=3, timeout_ms=2000)
    assert all(status == 200 for _, (status, _) in answers)
    assert max(server.count.latencies_ms) < 2000
    assert 1 <= server.count.late <= 4, "the first ones; then the next batch goes on without the hanging one"


def test_rules_that_we_do_not_know_are_answered():
    sent, referee = letter()
    sent["game"] |= {"map": "atlantis", "ruleset": {"name": "ladders", "settings": {"hazardDamagePerTurn": 10**6}}}
    server = SnakeServer(find_player("search"))

    async def talk(port):
        return await exchange(port, post("/move", sent))

    status, answer = serving(server, talk)
    assert (status, answer["move"] in safe_moves(referee.board, referee.settings, "s0")) == (200, True)


def test_a_serving_process_answers_before_it_thinks(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    answer_before_thinking()
    assert sys.getswitchinterval() == pytest.approx(0.0005)
    assert os.environ["OMP_NUM_THREADS"] == "3", "the user has the last word"
    monkeypatch.delenv("OMP_NUM_THREADS")
    answer_before_thinking()
    assert os.environ["OMP_NUM_THREADS"] == "1"


def test_what_was_loaded_is_not_searched_for_garbage_again():
    loaded, before = [[] for _ in range(1000)], gc.get_freeze_count()
    freeze_loaded()
    assert gc.get_freeze_count() > before + len(loaded)
    assert all(one is not loaded for one in gc.get_objects())

"""Foreign snakes in self-play: asked as the official engine asks, never learned from, missed when they are silent."""

import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.env.settings import GameSettings, SnakeConfig
from racecraft.worlds.battlesnake.env.world import WorldSettings
from racecraft.worlds.battlesnake.players.protocol import PlayerError
from racecraft.worlds.battlesnake.training import foreign_seats
from racecraft.worlds.battlesnake.training.self_play import (
    ANCHOR,
    FOREIGN,
    PAST,
    SELF,
    SelfPlayWorld,
    deal,
    world_settings,
)
from racecraft.worlds.battlesnake.training.settings import SelfPlayConfig


class Server:
    """A snake server that goes up, and writes down what it hears; silent if told."""

    def __init__(self):
        self.heard, self.is_silent = [], False
        whole = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                self.answer({"apiversion": "1", "color": "#112233"})

            def do_POST(self):
                told = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
                whole.heard.append((self.path, told["game"]["id"], told["turn"], told["you"]["id"]))
                self.answer({} if whole.is_silent else {"move": "up"})

            def answer(self, said):
                body = json.dumps(said).encode()
                self.send_response(200)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_): ...

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._server.server_port}"
        threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def close(self):
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture
def server():
    one = Server()
    yield one
    one.close()


def world_against(*foreign, num_games=4, seats=2, **config):
    shares = {"anchor_share": 0.25, "pool_share": 0.0, "foreign_share": 0.25, "foreign_ms": 20_000} | config
    played = world_settings(
        WorldSettings(GameSettings(7, 7, seats)), SnakeConfig(view=5, outlook=False, max_turns=12), num_games
    )
    return SelfPlayWorld(played, SelfPlayConfig(foreign=foreign, **shares))


def test_foreign_games_are_dealt_only_where_there_are_any_and_then_at_least_one():
    shares = {"anchor_share": 0.25, "pool_share": 0.25}
    assert deal(8, SelfPlayConfig(**shares)) == [ANCHOR] * 2 + [PAST] * 2 + [SELF] * 4
    assert deal(8, SelfPlayConfig(foreign=("hungry",), foreign_share=0.5, **shares)) == (
        [ANCHOR] * 2 + [FOREIGN] * 4 + [PAST] * 2
    )
    assert deal(4, SelfPlayConfig(foreign=("hungry",), foreign_share=0.0, anchor_share=1.0)) == [ANCHOR] * 3 + [FOREIGN]


def test_a_server_is_asked_as_the_engine_asks_and_moves_as_it_says(server):
    world = world_against(server.url)
    assert world.dealt == [ANCHOR, FOREIGN, SELF, SELF]
    assert len(world.mine[1].nonzero()[0]) == 1, "its seat is no row"
    buffers = allocate(world.spec)
    world.reset(buffers, 3)
    games = 0
    for _ in range(30):
        world.step(buffers.action_mask.argmax(axis=2), buffers)
        assert world._moves[1, 1] == MOVES.index("up") or not world._buffers.active[1, 1]
        games += bool(buffers.ended[1, 0])
    world.close()
    told = [path for path, *_ in server.heard]
    assert games > 1
    assert told.count("/start") >= games
    assert told.count("/start") == told.count("/end")
    assert {who for *_, who in server.heard} == {"s1"}
    first = server.heard[0][1]
    turns = [turn for path, game, turn, _ in server.heard if path == "/move" and game == first]
    assert turns == list(range(len(turns)))


def test_a_snake_that_never_answers_ends_the_training_with_its_name(server, monkeypatch):
    monkeypatch.setattr(foreign_seats, "SILENT_MOVES", 5)
    server.is_silent = True
    world = world_against(server.url)
    buffers = allocate(world.spec)
    world.reset(buffers, 3)

    def play():
        for _ in range(40):
            world.step(buffers.action_mask.argmax(axis=2), buffers)

    with pytest.raises(PlayerError, match=f"{server.url} gave none of the last 5 moves"):
        play()
    world.close()


def test_built_in_players_and_files_sit_there_too(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("def move(game):\n    return 'down'\n")
    world = world_against(str(path), "area_control", seats=3, num_games=4, foreign_share=0.5)
    buffers = allocate(world.spec)
    world.reset(buffers, 3)
    for _ in range(3):
        alive = world._buffers.active[1:3, 1:].copy()
        world.step(buffers.action_mask.argmax(axis=2), buffers)
        files = np.array([[True, False], [False, True]]) & alive
        assert (world._moves[1:3, 1:][files] == MOVES.index("down")).all(), "they take turns at the seats"
    world.close()


def test_a_server_that_is_not_there_is_named():
    with pytest.raises(PlayerError, match="http://127.0.0.1:9"):
        world_against("http://127.0.0.1:9")

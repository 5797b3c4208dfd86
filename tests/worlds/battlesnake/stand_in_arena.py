"""A stand-in of the official arena of 2026, of ours, in Python: what it sends a snake, waits for, and keeps of a game.

What differs from the documented API is as the arena does it: the dead stay on the board, a late answer is played as
straight on, a miss has latency "0", the status of an answer is not looked at, 500 ms for the headers and 600 ms in all,
health probes, a game tried again under its id. Its rules are the referee's.
"""

import http.client
import json
import time
import uuid
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import default_move

HEADERS_SECONDS, BODY_SECONDS, PROBE_SECONDS = 0.5, 0.6, 5.0
GAME_TYPES = {
    "standard": {},
    "royale": {"ruleset": "royale"},
    "constrictor": {"ruleset": "constrictor", "food_spawn_chance": 0, "minimum_food": 0},
    "snail": {"map": "snail_mode"},
    "solo": {"ruleset": "solo"},
}
CAUSES = {"snake-self-collision": "self-collision"}


class Remote:
    """A snake behind a URL."""

    def __init__(self, url):
        self.address = urlsplit(url).netloc

    def ask(self, path, body, headers_seconds=HEADERS_SECONDS, seconds=BODY_SECONDS):
        """Return (status, JSON or None, seconds to the headers); (0, None, …) after a timeout or an error."""
        begun = time.monotonic()
        connection = http.client.HTTPConnection(self.address, timeout=headers_seconds)
        try:
            data = None if body is None else json.dumps(body)
            connection.request("POST" if data else "GET", path, data, {"Content-Type": "application/json"})
            answer = connection.getresponse()
            taken = time.monotonic() - begun
            connection.sock and connection.sock.settimeout(max(0.001, seconds - taken))
            text = answer.read()
            return answer.status, json.loads(text) if text else None, taken
        except (OSError, http.client.HTTPException, ValueError):
            return 0, None, time.monotonic() - begun
        finally:
            connection.close()


class Scripted:
    """A snake whose move is a function of (board, its id)."""

    def __init__(self, choose):
        self.choose = choose


class StandInArena:
    """Holds one game; `play` may be called again: the arena tries a game again under the same ids."""

    def __init__(self, snakes, game_type="standard", size=11, seed=0):
        self.snakes, self.game_type = snakes, game_type
        self.settings = GameSettings(size, size, len(snakes), **GAME_TYPES[game_type])
        self.id = str(uuid.UUID(int=seed + 1))
        self.ids = [str(uuid.UUID(int=100 + number)) for number in range(len(snakes))]
        self.seed, self.frames, self.status, self.winner = seed, [], "waiting", None
        self.statuses, self.missed = [], 0

    def play(self, most_turns=5000, referee=None):
        """Play until the game is over; `most_turns` breaks off, as a job that dies does."""
        self.seed += 1000
        self.referee = referee or Referee(self.settings, StreamDice(self.seed))
        for snake, one in zip(self.referee.board.snakes, self.ids, strict=True):
            snake.id = one
        self.frames, self.status = [], "running"
        self.last = dict.fromkeys(self.ids, "up")
        self.latencies = dict.fromkeys(self.ids, "0")
        self._to_all("/start")
        self._keep_frame()
        while not self.referee.over and self.referee.board.turn < most_turns:
            board = self.referee.board
            alive = [snake.id for snake in board.alive()]
            with ThreadPoolExecutor(len(alive)) as pool:
                words = list(pool.map(self._move, alive))
            self.referee.turn(dict(zip(alive, words, strict=True)))
            self._keep_frame()
        if self.referee.over:
            self._to_all("/end")
            self.status = "finished"
            left = self.referee.board.alive()
            self.winner = left[0].id if left else None
        return self

    def message(self, one):
        """What a snake is sent: every snake of the game, the dead as they died, unmarked."""
        board = self.referee.board
        everyone = [self._snake(snake) for snake in board.snakes]
        hazards = [point for point, n in sorted(board.hazards.items()) for _ in range(n) if board.holds(point)]
        standard = self.settings.ruleset == "standard"
        return {
            "game": {
                "id": self.id,
                "ruleset": {
                    "name": self.settings.ruleset,
                    "version": "v1.0.0",
                    "settings": {
                        "foodSpawnChance": self.settings.food_spawn_chance,
                        "minimumFood": self.settings.minimum_food,
                        "hazardDamagePerTurn": 15 if standard and self.game_type == "standard" else 14,
                        "royale": {"shrinkEveryNTurns": 25 if self.game_type == "royale" else 0},
                        "squad": {"allowBodyCollisions": False},
                    },
                },
                "map": "snail_mode" if self.game_type == "snail" else "",
                "timeout": 500,
                "source": "",
            },
            "turn": board.turn,
            "board": {
                "width": board.width,
                "height": board.height,
                "snakes": everyone,
                "food": [{"x": x, "y": y} for x, y in board.food],
                "hazards": [{"x": x, "y": y} for x, y in hazards],
            },
            "you": next(part for part in everyone if part["id"] == one),
        }

    def probe(self, url):
        """The health sweep; tell whether the snake passed it."""
        snake = Remote(url)
        lone = StandInArena({"probe": None})
        lone.id, lone.ids = str(uuid.uuid4()), [str(uuid.uuid4())]
        lone.referee = Referee(lone.settings, StreamDice(7))
        lone.referee.board.snakes[0].id = lone.ids[0]
        lone.latencies = {lone.ids[0]: "0"}
        body = lone.message(lone.ids[0])
        passed = []
        for path, data in (("/", None), ("/start", body), ("/move", body), ("/end", body)):
            status, answer, _ = snake.ask(path, data, PROBE_SECONDS, PROBE_SECONDS)
            fits = {"/": lambda a: a["apiversion"] == "1", "/move": lambda a: a["move"] in MOVES}
            passed.append(200 <= status < 300 and fits.get(path, lambda a: True)(answer))
        return all(passed)

    # What its API tells of the game

    def game(self):
        """`GET /api/games/{id}`."""
        status = "complete" if self.status == "finished" else "running"
        size = {"Width": self.settings.width, "Height": self.settings.height}
        return {"Game": {"ID": self.id, "Status": status, **size}}

    def page(self, offset=0, limit=100):
        """`GET /api/games/{id}/frames`."""
        frames = self.frames[offset : offset + limit]
        return {"count": len(frames), "frames": frames}

    def details(self):
        """`GET /api/games/{id}/details`."""
        size = f"{self.settings.width}x{self.settings.height}"
        told = {"id": self.id, "status": self.status, "winner": self.winner, "frames": self.frames}
        return told | {"board": size, "game_type": self.game_type, "snakes": [], "created_at": "2026-08-20T00:00:00Z"}

    def events(self):
        """What the WebSocket `/api/games/{id}/events` sends."""
        return [*({"Type": "frame", "Data": data} for data in self.frames), {"Type": "game_end", "Data": {}}]

    def _to_all(self, path):
        for one, snake in zip(self.ids, self.snakes.values(), strict=True):
            if isinstance(snake, Remote):
                snake.ask(path, self.message(one))

    def _move(self, one):
        snake = self.snakes[list(self.snakes)[self.ids.index(one)]]
        board = self.referee.board
        if isinstance(snake, Scripted):
            return snake.choose(board, one)
        status, answer, taken = snake.ask("/move", self.message(one))
        self.statuses.append(status)
        word = answer.get("move", "").lower() if isinstance(answer, dict) else ""
        self.latencies[one] = str(round(1000 * taken)) if status else "0"
        self.missed += word not in MOVES
        if word not in MOVES:
            body = next(s.body for s in board.snakes if s.id == one)
            word = default_move(body, board.width, board.height) if board.turn else self.last[one]
        self.last[one] = word
        return word

    def _snake(self, snake):
        body = [{"x": x, "y": y} for x, y in snake.body]
        return {
            "id": snake.id, "name": self._name(snake.id), "health": snake.health, "body": body, "head": body[0],
            "length": len(body), "latency": self.latencies[snake.id] if snake.alive else "0", "shout": "x" * 300,
            "squad": "", "customizations": {"color": "#aabbcc", "head": "default", "tail": "default"},
        }  # fmt: skip

    def _name(self, one):
        return list(self.snakes)[self.ids.index(one)]

    def _keep_frame(self):
        board = self.referee.board
        hazards = [point for point, n in sorted(board.hazards.items()) for _ in range(n) if board.holds(point)]
        self.frames.append(
            {
                "Turn": board.turn,
                "Snakes": [self._frame_of(snake) for snake in board.snakes],
                "Food": [{"X": x, "Y": y} for x, y in board.food],
                "Hazards": [{"X": x, "Y": y} for x, y in hazards],
            }
        )

    def _frame_of(self, snake):
        cause = CAUSES.get(snake.cause, snake.cause)
        death = {"Cause": cause, "Turn": snake.on, "EliminatedBy": snake.by}
        return {
            "ID": snake.id, "Name": self._name(snake.id), "Body": [{"X": x, "Y": y} for x, y in snake.body],
            "Health": snake.health, "Color": "#aabbcc", "HeadType": "default", "TailType": "default",
            "Latency": "timeout" if self.latencies[snake.id] == "0" else self.latencies[snake.id], "Shout": "",
            "Squad": "", "APIVersion": "1", "Author": "somebody", "Death": None if snake.alive else death,
            "EliminatedCause": cause, "EliminatedBy": snake.by,
        }  # fmt: skip

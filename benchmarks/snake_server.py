"""Two hundred games at once on one snake server: `python benchmarks/snake_server.py [PLAYER|RUN|FILE.py]`.

Without a player, a policy of the default size is made first by one iteration of `racecraft snakes train`: what it costs
to ask it does not depend on how well it plays.

The server is `racecraft snakes serve`'s own, in this process; the games are played by clients in a process of their own
(`--clients`, started by the first), one connection a game, kept open. A client thinks for 100 ms, sends its snake's
position of an 11×11 game of four snakes under way, and waits for the answer; the timeout is 500 ms. After five seconds
of warming up, figures are taken for the seconds asked for.

Prints one JSON object: late answers (more than 500 ms at the client, or a move that the server made because the player
was not done), each of the two by itself, games that it refused because it was too busy, p50 and p99 measured at the
server (from a request's first bytes to its answer) and at the clients, and how late the clients themselves looked at
what came (the mean of the last second), which counts as the server's lateness too.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import quantiles
from typing import Any

THINKING_SECONDS = 0.1
TIMEOUT_MS = 500
WARM_UP_SECONDS = 5.0
POSITIONS = 64


def main() -> None:
    """Measure and print; or, started by ourselves, play the clients."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("player", nargs="?")
    parser.add_argument("--games", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--clients", type=int, default=0, metavar="PORT", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.clients:
        print(json.dumps(asyncio.run(play(asked.clients, asked.games, asked.seconds))))
        return
    with tempfile.TemporaryDirectory() as folder:
        player = asked.player or fresh_policy(Path(folder) / "run")
        figures = measure(player, asked.games, asked.seconds)
    print(json.dumps(figures | {"player": asked.player or "policy"}))


def fresh_policy(run: Path) -> str:
    """Train for one iteration; return the run's name."""
    command = [sys.executable, "-m", "racecraft", "snakes", "train", "--stop", "iterations=1", "--run", str(run)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return str(run)


def measure(name: str, games: int, seconds: float) -> dict[str, Any]:
    """Serve a player in a thread, let the clients play, and return the figures."""
    from racecraft.serving.quick_answers import answer_before_thinking, freeze_loaded
    from racecraft.web.server import ServerThread
    from racecraft.worlds.battlesnake.players.find import find_player, warm_up
    from racecraft.worlds.battlesnake.players.protocol import BatchPlayer
    from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer

    answer_before_thinking()
    player = find_player(name)
    warm_up(player)
    freeze_loaded()
    server = SnakeServer(player)
    thread = ServerThread(server.application, "snake")
    port = thread.start("127.0.0.1", 0)
    command = [sys.executable, __file__, "--clients", str(port), "--games", str(games), "--seconds", str(seconds)]
    clients = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert clients.stdout is not None
    clients.stdout.readline()  # they are warm, and begin to count
    count = server.count
    count.latencies_ms.clear()
    late, failed, moves, cpu = count.late, count.failed, count.moves, time.process_time()
    at_clients = json.loads(clients.stdout.read())
    spent = time.process_time() - cpu
    clients.wait()
    thread.close()
    server.close()
    return {
        "games": games, "seconds": seconds, "cores": os.cpu_count(),
        "many_at_once": isinstance(player, BatchPlayer), "moves": count.moves - moves,
        "late": max(count.late - late, at_clients["late_at_clients"]), "made_by_server": count.late - late,
        "failed": count.failed - failed, "server_cpu_us_a_move": round(spent / (count.moves - moves) * 1e6, 1),
        "p50_ms": round(count.within_ms(0.5), 1), "p99_ms": round(count.p99_ms(), 1), **at_clients,
    }  # fmt: skip


async def play(port: int, games: int, seconds: float) -> dict[str, Any]:
    """Play all clients; return what they saw after warming up."""
    from racecraft.serving.loop_lag import LoopLag

    requests, own_lag = positions(), LoopLag()
    own_lag.watch()
    begin = time.perf_counter()
    counted, ends = begin + WARM_UP_SECONDS, begin + WARM_UP_SECONDS + seconds
    taken: list[float] = []
    refused: list[int] = []
    asyncio.get_running_loop().call_later(WARM_UP_SECONDS, lambda: print("counting", flush=True))
    await asyncio.gather(
        *(client(port, number, games, requests, counted, ends, taken, refused) for number in range(games))
    )
    own_lag.close()
    cuts = quantiles(taken, n=100)
    return {
        "moves_a_second": round(len(taken) / seconds), "late_at_clients": sum(one > TIMEOUT_MS / 1000 for one in taken),
        "client_p50_ms": round(1000 * cuts[49], 1), "client_p99_ms": round(1000 * cuts[98], 1),
        "client_worst_ms": round(1000 * max(taken), 1), "games_refused": len(refused),
        "clients_lag_ms": round(1000 * own_lag.lasting_seconds, 1),
    }  # fmt: skip


async def client(
    port: int, number: int, games: int, requests: list[bytes], counted: float, ends: float, taken: list[float],
    refused: list[int],
) -> None:  # fmt: skip
    """Play one game: think, ask, wait, again; give it up where the server refuses it."""
    await asyncio.sleep(THINKING_SECONDS * number / games)
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    turn = number
    while (sent := time.perf_counter()) < ends:
        writer.write(requests[turn % len(requests)].replace(b"GAME", b"%04d" % number))
        head = await reader.readuntil(b"\r\n\r\n")
        await reader.readexactly(int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0]))
        if head.startswith(b"HTTP/1.1 503"):
            refused.append(number)
            break
        assert head.startswith(b"HTTP/1.1 200"), head
        now = time.perf_counter()
        if counted <= now < ends:
            taken.append(now - sent)
        turn += 1
        await asyncio.sleep(THINKING_SECONDS)
    writer.close()


def positions() -> list[bytes]:
    """Return requests of positions of one game under way; the game's id is GAME."""
    from racecraft.worlds.battlesnake.env.dice import StreamDice
    from racecraft.worlds.battlesnake.env.reference import Referee
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.players.messages import GameCard, message
    from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move

    settings, found, key = GameSettings(11, 11, 4), [], 0
    while len(found) < POSITIONS:
        referee, key = Referee(settings, StreamDice(key)), key + 1
        while not referee.over and len(found) < POSITIONS:
            board = referee.board
            for snake in board.alive()[:1]:
                body = json.dumps(message(board, settings, snake.id, GameCard("GAME", TIMEOUT_MS))).encode()
                found.append(b"POST /move HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
            referee.turn({snake.id: best_safe_move(board, settings, snake.id) for snake in board.alive()})
    return found


if __name__ == "__main__":
    main()

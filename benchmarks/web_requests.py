"""Processor time of a request: `python benchmarks/web_requests.py [--seconds 4]`.

2 kB of JSON come and a few bytes go, on 100 connections that stay open, as fast as one server process answers. Three
ways by turns, each in a process of its own; the clients are another. Prints one JSON object: microseconds of the
server's processor a request, user and system together, for each way and round.

    uvicorn      uvicorn alone: json.loads, no limits, no errors
    json_api     `web/json_api.py`, as the snake's webhook and the endpoint are served
    application  `web/application.py`, as pages are served: routes, who may ask, limits, headers
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import subprocess
import sys
import time
from typing import Any

CONNECTIONS = 100
QUESTION = json.dumps({"numbers": list(range(430)), "text": "a" * 120}).encode()
WAYS = ("uvicorn", "json_api", "application")
WARM_UP_SECONDS = 1.0


def main() -> None:
    """Measure and print; or, started by ourselves, serve or ask."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--serve", choices=WAYS, help=argparse.SUPPRESS)
    parser.add_argument("--ask", type=int, metavar="PORT", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        serve_way(asked.serve)
    elif asked.ask:
        print(asyncio.run(ask(asked.ask, asked.seconds)))
    else:
        figures: dict[str, list[float]] = {way: [] for way in WAYS}
        for _ in range(asked.rounds):
            for way in WAYS:
                figures[way].append(measure(way, asked.seconds))
        print(json.dumps({"bytes": len(QUESTION), "load": os.getloadavg()[0], "us_a_request": figures}))


def measure(way: str, seconds: float) -> float:
    """Return microseconds of processor time a request."""
    server = subprocess.Popen([sys.executable, __file__, "--serve", way], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        port = server.stdout.readline().strip()
        clients = [sys.executable, __file__, "--ask", port, "--seconds"]
        subprocess.run([*clients, str(WARM_UP_SECONDS)], check=True, stdout=subprocess.DEVNULL)
        before = _processor_seconds(server.pid)
        answered = int(subprocess.run([*clients, str(seconds)], check=True, stdout=subprocess.PIPE).stdout)
        return round((_processor_seconds(server.pid) - before) / answered * 1e6, 1)
    finally:
        server.kill()
        server.wait()


async def ask(port: int, seconds: float) -> int:
    """Ask on all connections; return how many answers came."""
    head = b"POST /move HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: %d\r\n\r\n" % len(QUESTION)
    answered, ends = 0, time.perf_counter() + seconds

    async def client() -> None:
        nonlocal answered
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        while time.perf_counter() < ends:
            writer.write(head + QUESTION)
            told = (await reader.readuntil(b"\r\n\r\n")).lower()
            assert b" 200 " in told.split(b"\r\n")[0], told
            await reader.readexactly(int(told.split(b"content-length: ")[1].split(b"\r\n")[0]))
            answered += 1
        writer.close()

    await asyncio.gather(*(client() for _ in range(CONNECTIONS)))
    return answered


def serve_way(way: str) -> None:
    """Serve until killed; print the port."""
    from racecraft.web.server import serve

    def ready(port: int) -> None:
        print(port, flush=True)

    if way == "uvicorn":
        asyncio.run(_serve_alone(ready))
    else:
        serve(_json_api() if way == "json_api" else _application(), "127.0.0.1", 0, ready)


def _json_api() -> Any:
    from racecraft.web.json_api import ApiRequest, JsonApi

    async def answer(request: ApiRequest) -> dict[str, Any]:
        return _answer(request.json())

    return JsonApi(answer)


def _application() -> Any:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import Route

    from racecraft.web.access import ONLY_HERE
    from racecraft.web.answers import json_answer
    from racecraft.web.application import make_application

    async def answer(request: Request) -> Response:
        return json_answer(_answer(json.loads(await request.body())))

    return make_application([Route("/move", answer, methods=["POST"])], ONLY_HERE, compress=False)


async def _serve_alone(ready: Any) -> None:
    import socket

    import uvicorn

    async def answer(scope: Any, receive: Any, send: Any) -> None:
        body, more = b"", True
        while more:
            message = await receive()
            body, more = body + message["body"], message["more_body"]
        told = json.dumps(_answer(json.loads(body))).encode()
        headers = [(b"content-type", b"application/json"), (b"content-length", b"%d" % len(told))]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": told})

    listening = socket.create_server(("127.0.0.1", 0))
    ready(listening.getsockname()[1])
    config = uvicorn.Config(answer, http="httptools", lifespan="off", log_config=None, access_log=False)
    await uvicorn.Server(config).serve(sockets=[listening])


def _answer(question: dict[str, Any]) -> dict[str, Any]:
    return {"move": "up", "count": len(question["numbers"])}


def _processor_seconds(process: int) -> float:
    with open(f"/proc/{process}/stat", encoding="ascii") as file:
        words = file.read().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()

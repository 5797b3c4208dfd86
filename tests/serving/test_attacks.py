"""Every server of ours under attack: each attack is refused by name, and the server answers afterwards.

Two kinds: pages and endpoints of this machine (this machine's names, no other site's page) and what anyone may ask (the
snake's webhook, an endpoint and metrics opened with --host).
"""

import json
import socket
import time
from contextlib import ExitStack, nullcontext

import numpy as np
import pytest
from starlette.requests import Request
from starlette.routing import Route

from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import TrainedPolicy, policy_from
from racecraft.serving.endpoint_server import EndpointServer
from racecraft.serving.metrics_server import MetricsServer
from racecraft.serving.watch_server import watch_routes
from racecraft.training.live_metrics import LiveMetrics
from racecraft.web.access import ANYONE, Access, checked_fields, opened
from racecraft.web.answers import json_answer
from racecraft.web.application import make_application
from racecraft.web.server import ServerThread

TOKEN = "made-at-this-start"


def of_endpoint(stack, access):
    world = WorldSpec("toy", 1, 1, {"state": ArraySpec((3,), np.float32)}, DiscreteActions(2))
    learner = PpoLearner(world, NetworkConfig(hidden_units=(4,)), PpoConfig(), seed=1)
    policy = policy_from(learner.policy_spec, learner.network.state_dict())
    run = type("Run", (), {"path": "runs/toy"})()
    server = EndpointServer(TrainedPolicy(run, None, learner.policy_spec, policy, {}), access=access)
    stack.callback(server.close)
    return started(stack, server.application)


def of_metrics(stack, host):
    server = MetricsServer(LiveMetrics("car").registry, host, 0)
    stack.callback(server.close)
    return int(server.address.split(":")[2].split("/")[0])


def of_webhook(stack):
    from racecraft.worlds.battlesnake.players.find import find_player
    from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer

    server = SnakeServer(find_player("hungry"))
    stack.callback(server.close)
    return started(stack, server.application)


def of_board(stack):
    from racecraft.worlds.battlesnake.analysis.board_frames import game_facts
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.players.messages import GameCard
    from racecraft.worlds.battlesnake.serving.board_server import BoardServer

    server = BoardServer("a game", game_facts(GameSettings(7, 7, 2), GameCard("g")))
    stack.callback(server.close)
    return int(server.start().split(":")[2])


def of_arena(stack, folder):
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ArenaTerms
    from racecraft.worlds.battlesnake.serving.arena_server import ArenaServer

    server = ArenaServer(ArenaStore.begin(folder / "arena.sqlite", ArenaTerms(7, 7, snakes=(2,))))
    stack.callback(server.close)
    return int(server.start().split(":")[2].strip("/"))


def of_watch(stack, folder, access=None):
    run = RunFolder.create(folder / f"run{access is None}", {"kind": "gymnasium", "settings": {}, "name": "x"})
    return started(stack, make_application(watch_routes(run), *([access] if access else [])))


def of_console(stack, folder):
    from racecraft.console import application
    from racecraft.jobs.job_paths import JobPaths

    patch = stack.enter_context(pytest.MonkeyPatch.context())
    patch.setattr(application, "keep_warm", lambda home: nullcontext())
    home = JobPaths(folder / "jobs", f"sqlite:///{folder / 'jobs.sqlite'}")
    return started(stack, application.make_console(folder / "workspace", home))


def of_forms(stack):
    async def change(request: Request):
        async with request.form() as form:
            return json_answer(checked_fields(request, form))

    return started(stack, make_application([Route("/", change, methods=["GET", "POST"])]))


def started(stack, application):
    thread = ServerThread(application, "attacked")
    stack.callback(thread.close)
    return thread.start("127.0.0.1", 0)


LOCAL = ("endpoint", "metrics", "watch", "arena", "console", "board")
ANYONES = ("webhook", "open endpoint", "open metrics")
ALIVE = {"metrics": "/metrics", "open metrics": "/metrics"}


@pytest.fixture(scope="module")
def ports(tmp_path_factory):
    folder = tmp_path_factory.mktemp("attacked")
    with ExitStack() as stack:
        yield {
            "endpoint": of_endpoint(stack, Access()),
            "open endpoint": of_endpoint(stack, ANYONE),
            "metrics": of_metrics(stack, "127.0.0.1"),
            "open metrics": of_metrics(stack, "0.0.0.0"),
            "webhook": of_webhook(stack),
            "board": of_board(stack),
            "arena": of_arena(stack, folder),
            "watch": of_watch(stack, folder),
            "opened watch": of_watch(stack, folder, opened(TOKEN)),
            "console": of_console(stack, folder),
        }


def send(port, data, then=b""):
    """Send bytes, then more; return status, name of the error and body of what comes back."""
    with socket.create_connection(("127.0.0.1", port), timeout=60) as other:
        other.sendall(data)
        if then:
            time.sleep(0.05)
            other.sendall(then)
        file = other.makefile("rb")
        line = file.readline()
        headers = dict(part.decode("latin-1").strip().lower().split(": ", 1) for part in iter(file.readline, b"\r\n"))
        body = file.read(int(headers.get("content-length", 0)))
    try:
        name = json.loads(body)["error"]
    except (ValueError, KeyError, TypeError):
        name = ""
    return int(line.split()[1]), name, body


def request(path="/", method="GET", body=b"", **headers):
    named = {"Host": "127.0.0.1"} | {name.replace("_", "-"): value for name, value in headers.items()}
    if body:
        named["Content-Length"] = str(len(body))
    lines = "".join(f"{name}: {value}\r\n" for name, value in named.items())
    return f"{method} {path} HTTP/1.1\r\n{lines}\r\n".encode() + body


def require_alive(ports, server):
    status, _, _ = send(ports[server], request(ALIVE.get(server, "/")))
    assert status == (401 if server == "opened watch" else 200), server


@pytest.mark.parametrize("server", LOCAL)
def test_another_name_that_leads_to_this_machine_is_refused(ports, server):
    for host in ("evil.example", "evil.example:8100", "127.0.0.1.evil.example", "127.0.0.1@evil.example", ""):
        assert send(ports[server], request(Host=host))[:2] == (403, "foreign_host"), host
    rebound = request(method="POST", body=b"{}", Host="evil.example", Origin="http://evil.example")
    assert send(ports[server], rebound)[:2] == (403, "foreign_host")
    require_alive(ports, server)


@pytest.mark.parametrize("server", [one for one in LOCAL if one != "board"])
def test_another_sites_page_can_neither_change_nor_read(ports, server):
    attacks = (
        request(method="POST", body=b"a=b", Origin="https://evil.example"),
        request(method="POST", body=b"a=b", Origin="null"),
        request(method="POST", body=b"a=b", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="no-cors"),
        request(Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="cors", Origin="https://evil.example"),
        request(Sec_Fetch_Site="same-site", Sec_Fetch_Mode="no-cors"),
    )
    for attack in attacks:
        assert send(ports[server], attack)[:2] == (403, "foreign_site"), attack
    require_alive(ports, server)


@pytest.mark.parametrize("server", ANYONES)
def test_what_anyone_may_ask_is_answered_under_every_name(ports, server):
    foreign = request(ALIVE.get(server, "/"), Host="laptop.example", Origin="https://board.example")
    assert send(ports[server], foreign)[0] == 200


def test_an_opened_page_wants_its_token(ports):
    port = ports["opened watch"]
    for headers in ({}, {"Authorization": "Bearer guess"}, {"Cookie": f"racecraft-{port}={TOKEN}"}):
        assert send(port, request(**headers))[:2] == (401, "no_token"), headers
    for shown in ("", "guess", TOKEN[:-1], TOKEN + "x"):
        assert send(port, request(f"/?token={shown}"))[:2] == (401, "no_token"), shown
    assert send(port, request(Authorization=f"Bearer {TOKEN}"))[0] == 200
    assert send(port, request(f"/?token={TOKEN}"))[0] == 303


def test_a_form_without_its_pages_token_changes_nothing():
    with ExitStack() as stack:
        port = of_forms(stack)
        form = {"Content_Type": "application/x-www-form-urlencoded"}
        for body in (b"name=x", b"name=x&form_token=", b"name=x&form_token=guess"):
            assert send(port, request("/", "POST", body, **form))[:2] == (403, "forged_form")


HUGE = 8 * 2**40
GET, POST = (f"{method} / HTTP/1.1\r\nHost: 127.0.0.1\r\n".encode() for method in ("GET", "POST"))
HEADS = {
    "a line without end": (b"GET /" + b"a" * 300_000, 431, "headers_too_large"),
    "a header without end": (GET + b"X: " + b"a" * 300_000, 431, "headers_too_large"),
    "ten thousand headers": (GET + b"a: b\r\n" * 10_000 + b"\r\n", 431, "headers_too_large"),
    "TLS": (b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n", 400, "bad_request"),
    "HTTP/2": (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 400, "bad_request"),
    "two lengths": (POST + b"Content-Length: 5\r\nContent-Length: 6\r\n\r\nhello", 400, "bad_request"),
    "a length and chunks": (
        POST + b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400, "bad_request",
    ),
    "a length below zero": (POST + b"Content-Length: -1\r\n\r\n", 400, "bad_request"),
}  # fmt: skip


@pytest.mark.parametrize("server", [*LOCAL, *ANYONES, "opened watch"])
def test_heads_that_are_no_heads_are_refused(ports, server):
    for what, (data, status, name) in HEADS.items():
        assert send(ports[server], data)[:2] == (status, name), what
    require_alive(ports, server)


TAKES_A_BODY = {"endpoint": "/invocations", "open endpoint": "/invocations", "webhook": "/move"}


@pytest.mark.parametrize("server", TAKES_A_BODY)
def test_huge_bodies_are_refused_before_they_are_read(ports, server):
    head = f"POST {TAKES_A_BODY[server]} HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    announce_job = f"{head}Content-Length: {HUGE}\r\n\r\n".encode()
    chunked = f"{head}Transfer-Encoding: chunked\r\n\r\n".encode() + b"10000\r\n" + b"[" * 65536 + b"\r\n"
    assert send(ports[server], announce_job, b"x")[1] == "body_too_large"
    assert send(ports[server], chunked, (b"10000\r\n" + b"[" * 65536 + b"\r\n") * 20)[1] == "body_too_large"
    packed = request(TAKES_A_BODY[server], "POST", b"\x1f\x8b\x08", Content_Encoding="gzip")
    assert send(ports[server], packed)[:2] == (415, "content_encoding")
    require_alive(ports, server)


@pytest.mark.parametrize("server", [*LOCAL, *ANYONES])
def test_no_path_leads_out(ports, server):
    for path in (
        "/../../../../etc/passwd", "/%2e%2e/%2e%2e/%2e%2e/etc/passwd", "/..%2f..%2f..%2fetc%2fpasswd",
        "/assets/../../../etc/passwd", "/assets/..%2f..%2f..%2fetc%2fpasswd", "/assets/%2fetc%2fpasswd",
        "//etc/passwd", "/etc/passwd%00.css", "/games/../../etc/passwd", "/models/..%2f..%2fetc",
    ):  # fmt: skip
        status, _, body = send(ports[server], request(path))
        assert 400 <= status < 500, path
        assert b"root:" not in body, path
    require_alive(ports, server)


@pytest.mark.parametrize("server", ["endpoint", "webhook", "arena", "watch"])
def test_who_trickles_is_not_waited_for(ports, server, monkeypatch):
    for place in ("limits.SECONDS_FOR_A_HEAD", "limits.SECONDS_FOR_A_BODY"):
        monkeypatch.setattr(f"racecraft.web.{place}", 0.2)
    assert send(ports[server], b"GET / HTTP/1.1\r\nHost: 127")[:2] == (408, "too_slow")
    if server in TAKES_A_BODY:
        half = f"POST {TAKES_A_BODY[server]} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\nhalf"
        assert send(ports[server], half.encode())[:2] == (408, "too_slow")
    require_alive(ports, server)

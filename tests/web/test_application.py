"""An application of ours: who may ask, how much, how errors are answered, and that it lives on after each."""

import errno
import json
import re
import socket
import time

import pytest
from starlette.routing import Route

from racecraft.contract.errors import UserInputError
from racecraft.web.access import ANYONE, Access, checked_fields, opened
from racecraft.web.answers import json_answer, page_answer
from racecraft.web.errors import WebError


def value(request):
    return json_answer({"loss": float("nan"), "path": request.url.path})


def page(request):
    return page_answer(request, "page.html", title="A page", sections=[])


def fails(request):
    raise ZeroDivisionError("nobody foresaw it")


def refused(request):
    raise WebError(409, "taken", "found one; expected none.")


def unusable(request):
    raise UserInputError("runs/x: no such run.")


def full(request):
    raise OSError(errno.ENOSPC, "No space left on device")


def broken(request):
    raise OSError(errno.EIO, "Input/output error")


async def form(request):
    async with request.form() as form:
        return json_answer(checked_fields(request, form))


async def size(request):
    return json_answer({"size": len(await request.body())})


ROUTES = [
    Route("/", page), Route("/value", value), Route("/fails", fails), Route("/refused", refused),
    Route("/unusable", unusable), Route("/full", full), Route("/broken", broken),
    Route("/form", form, methods=["POST"]), Route("/size", size, methods=["POST"]),
]  # fmt: skip


@pytest.fixture
def client(served):
    with served(ROUTES, most_body={"/size": 5_000_000}) as found:
        yield found


def name_of(answer):
    return answer[0], json.loads(answer[2])["error"]


def test_what_is_no_number_is_null(client):
    assert json.loads(client.ask("/value")[2]) == {"loss": None, "path": "/value"}


@pytest.mark.parametrize(
    ("path", "expected"),
    [("/gone", (404, "not_found")), ("/refused", (409, "taken")), ("/unusable", (422, "not_usable")),
     ("/fails", (500, "internal")), ("/full", (507, "disk_full")), ("/broken", (500, "internal")),
     ("/form", (405, "wrong_method")), ("/assets/..%2fchart.py", (404, "not_found"))],
)  # fmt: skip
def test_errors_are_json_for_programs_and_a_page_for_browsers(client, path, expected):
    assert name_of(client.ask(path)) == expected
    status, headers, body = client.ask(path, Accept="text/html")
    assert (status, headers["content-type"]) == (expected[0], "text/html; charset=utf-8")
    assert b"<h1>" in body
    assert client.ask("/value")[0] == 200


def test_every_answer_keeps_to_its_site(client):
    for path in ("/", "/value", "/fails", "/gone"):
        headers = client.ask(path)[1]
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "", "[::1", "192.168.0.7:8100"])
def test_only_this_machine_is_named(client, host):
    assert name_of(client.ask("/value", Host=host)) == (403, "foreign_host")
    assert client.ask("/value", Host="LOCALHOST:1")[0] == 200


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": "http://127.0.0.1:1"},
     {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate"}, {"Sec_Fetch_Site": "same-site"}],
)  # fmt: skip
def test_other_sites_may_change_nothing(client, headers):
    assert name_of(client.ask("/size", "POST", "x", **headers)) == (403, "foreign_site")
    assert client.ask("/size", "POST", "x", Origin=f"http://127.0.0.1:{client.port}")[0] == 200


def test_other_sites_may_link_here_and_embed_nothing(client):
    assert client.ask("/", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="navigate")[0] == 200
    assert client.ask("/value", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="no-cors")[0] == 403


def test_a_form_needs_the_token_of_its_page(served):
    async def tell(request):
        return json_answer({"token": request.scope["racecraft.form_token"]})

    with served([*ROUTES, Route("/token", tell)]) as client:
        kind = "application/x-www-form-urlencoded"
        assert name_of(client.ask("/form", "POST", "a=1", Content_Type=kind)) == (403, "forged_form")
        assert name_of(client.ask("/form", "POST", "a=1&form_token=x", Content_Type=kind)) == (403, "forged_form")
        token = json.loads(client.ask("/token")[2])["token"]
        answer = client.ask("/form", "POST", f"a=1&form_token={token}", Content_Type=kind)
        assert json.loads(answer[2]) == {"a": ["1"]}


def test_opened_to_others_a_token_becomes_a_cookie(served):
    with served(ROUTES, opened("secret")) as client:
        assert name_of(client.ask("/value")) == (401, "no_token")
        assert name_of(client.ask("/value?token=wrong")) == (401, "no_token")
        status, headers, _ = client.ask("//evil.example/?token=secret&a=1", Host="192.168.0.7:8100")
        assert (status, headers["location"]) == (303, "/evil.example/?a=1")
        cookie = headers["set-cookie"]
        assert re.search("HttpOnly.*SameSite=lax", cookie)
        assert "secret" not in cookie
        assert client.ask("/value", Cookie=cookie.split(";")[0])[0] == 200
        assert client.ask("/value", Cookie=cookie.split("=")[0] + "=secret")[0] == 401
        assert client.ask("/value", Authorization="Bearer secret")[0] == 200


def test_a_webhook_answers_anyone(served):
    with served(ROUTES, ANYONE) as client:
        foreign = {"Host": "evil.example", "Origin": "http://evil.example", "Sec_Fetch_Site": "cross-site"}
        assert client.ask("/size", "POST", "x", **foreign)[0] == 200


def test_a_body_has_an_end_whatever_it_says_of_its_length(client):
    assert name_of(client.ask("/form", "POST", b"x" * 1_200_000)) == (413, "body_too_large")
    chunks = (b"x" * 100_000 for _ in range(70))
    assert name_of(client.ask("/size", "POST", chunks, Transfer_Encoding="chunked")) == (413, "body_too_large")
    assert json.loads(client.ask("/size", "POST", b"x" * 4_000_000)[2]) == {"size": 4_000_000}


def raw(port, data, pause=0.0):
    """Send bytes, wait, return all that comes back."""
    with socket.create_connection(("127.0.0.1", port), timeout=60) as other:
        other.sendall(data)
        time.sleep(pause)
        other.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: other.recv(65536), b""))


@pytest.mark.parametrize(
    ("data", "status"),
    [(b"no http at all\r\n\r\n", b"400"), (b"GET / HTTP/1.1\r\nX: " + b"a" * 60_000 + b"\r\n\r\n", b"431"),
     (b"GET / HTTP/1.1\r\nX: " + b"a" * 400_000, b"431")],
)  # fmt: skip
def test_a_head_has_an_end(client, data, status):
    assert raw(client.port, data).startswith(b"HTTP/1.1 " + status)
    assert client.ask("/value")[0] == 200


def test_who_does_not_go_on_is_not_waited_for(served, monkeypatch):
    monkeypatch.setattr("racecraft.web.limits.SECONDS_FOR_A_HEAD", 0.2)
    monkeypatch.setattr("racecraft.web.limits.SECONDS_FOR_A_BODY", 0.2)
    with served(ROUTES) as client, socket.create_connection(("127.0.0.1", client.port), timeout=60) as silent:
        assert raw(client.port, b"GET / HT", 0.4).startswith(b"HTTP/1.1 408")
        half = b"POST /size HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\nhalf"
        assert raw(client.port, half, 0.4).startswith(b"HTTP/1.1 408")
        assert silent.recv(1) == b""


def test_a_slow_body_lends_no_time_to_the_next_head(served, monkeypatch):
    monkeypatch.setattr("racecraft.web.limits.SECONDS_FOR_A_HEAD", 0.2)
    with served(ROUTES) as client, socket.create_connection(("127.0.0.1", client.port), timeout=2) as wire:
        wire.sendall(b"POST /size HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 4\r\n\r\nha")
        time.sleep(0.1)
        wire.sendall(b"lf")
        answer = b""
        while b'{"size":4}' not in answer:
            answer += wire.recv(4096)
        wire.sendall(b"GET / HT")
        assert wire.recv(4096).startswith(b"HTTP/1.1 408")


def test_access_names_hosts_of_its_own(served):
    with served(ROUTES, Access(frozenset({"car.local"}))) as client:
        assert client.ask("/value", Host="car.local:80")[0] == 200
        assert client.ask("/value")[0] == 403

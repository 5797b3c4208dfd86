"""The course over HTTP: pages, answers, what is kept, hostile requests."""

import json
import subprocess
import sys

import pytest
from tests.web.conftest import Client

from racecraft.lessons.course import PATHS, course
from racecraft.lessons.progress import Progress
from racecraft.lessons.service import make_lessons
from racecraft.web.server import ServerThread

ROAD = {"columns": 7, "pays": "centre", "moves": "ahead", "changed": []}


@pytest.fixture
def client(progress):
    thread = ServerThread(make_lessons(progress=progress), "test")
    yield Client(thread.start("127.0.0.1", 0))
    thread.close()


def post(client, path, value):
    body = value if isinstance(value, str) else json.dumps(value)
    status, _, said = client.ask(path, "POST", body, Content_Type="application/json")
    return status, json.loads(said)


def test_every_page_is_there(client, whole_course):
    paths = ["/lessons", "/lessons/words", *(f"/lessons/sheet/{path}" for path in PATHS)]
    for lesson in whole_course.lessons:
        paths += [f"/lessons/{lesson.id}", f"/lessons/{lesson.id}?slides=1"]
    for path in paths:
        status, _, body = client.ask(path, Accept="text/html")
        assert status == 200, (path, body[-300:])
    for missing in ("/lessons/none", "/lessons/sheet/none"):
        assert client.ask(missing)[0] in (404, 422)


def test_what_is_done_is_kept_and_a_prediction_is_locked(client, progress):
    path = "/lessons/grid/best-drive"
    status, told = post(client, path, {"drive": {"grid": ROAD, "moves": [1, 0, 1, 0]}})
    assert (status, told["state"], told["tries"]) == (200, "tried", 1)
    assert not told["worked"]
    _, told = post(client, path, {"drive": {"grid": ROAD, "moves": [1, 0, 1, 0]}})
    assert told["worked"], "the worked answer stands behind the second try"
    _, told = post(client, path, {"drive": {"grid": ROAD, "moves": [1] * 6}})
    assert told["state"] == "passed"
    post(client, path, {"drive": {"grid": ROAD, "moves": [0, 0]}})
    assert Progress(progress.path).of("grid")["best-drive"]["state"] == "passed", "it stays passed"
    assert b"1 of 5" in client.ask("/lessons")[2]


@pytest.mark.parametrize(
    "body", ["", "[", "[1]", "{" * 100_000, '{"drive": 3}', '{"drive": {"grid": {"columns": 1e9}, "moves": [1]}}']
)
def test_a_hostile_answer_is_refused_and_nothing_is_kept(client, progress, body):
    status, told = post(client, "/lessons/grid/best-drive", body)
    assert status in (400, 200)
    assert status == 400 or told["state"] == "unusable"
    assert progress.of("grid") == {}


def test_a_damaged_record_costs_no_lesson(client, progress):
    progress.path.write_text("{")
    assert client.ask("/lessons")[0] == 200


def test_the_first_page_finds_the_course_read():
    course.cache_clear()
    make_lessons()
    assert course.cache_info().currsize == 1


def test_the_course_begins_without_what_simulates_and_learns():
    """The first page of a fresh server waits for none of it."""
    code = "import sys; from racecraft.lessons.service import course; course(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "racecraft.lessons.course" in loaded
    assert not {"numpy", "numba", "torch", "polars", "matplotlib"} & set(loaded)

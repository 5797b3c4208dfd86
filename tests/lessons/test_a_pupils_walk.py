"""Every path, walked to its end by keyboard alone on a phone's width, and each page read by everybody."""

import subprocess
import sys

import pytest
from tests.browser import Browser, needs_chromium
from tests.lessons.pupil import Pupil

from racecraft.console.workspace import Workspace
from racecraft.lessons.course import course
from racecraft.lessons.progress import Progress
from racecraft.lessons.service import make_lessons
from racecraft.web.server import ServerThread

pytestmark = needs_chromium
OWN = {
    "race/own-lap": {"car": "newest"},
    "race/one-change": {"before": "first", "after": "newest", "expected": "undo", "reason": "keep"},
    "race/beat-the-first": {"first": "first", "own": "newest"},
    "reward-function/as-expected": {
        "before": "first",
        "own": "newest",
        "expected": "faster",
        "reason": "as_expected",
    },
    "tracks/new-road": {"car": "wide", "track": "reInvent2019_track"},
    "real/varied-car": {"plain": "newest", "varied": "varied"},
    "real/packed-car": {"car": "one-frame", "same": "all", "reason": "same_numbers"},
    "snake-learn/learned-beats": {"snake": "learned", "code": "def move(data):\n    return 'up'"},
    "snake-search/search-in-front": {"snake": "learned", "wins": "most", "reason": "replies"},
    "unity-learn/first-training": {"model": "basic"},
    "unity-back/same-decisions": {"model": "basic", "differ": "few", "reason": "same"},
    "unity-other/dqn": {"model": "basic-dqn"},
}
"""Answers that name models which a pupil trained."""
THREE = "reinvent_base,Oval_track,Bowtie_track"
TRAINED = {
    "car": {
        "first": ("train", "--stop", "iterations=2", "--no-pictures"),
        "wide": (
            "train",
            "--tracks",
            "reinvent_base,Oval_track,Bowtie_track",
            "--stop",
            "iterations=60",
            "--no-pictures",
        ),
        "one-frame": ("train", "--stop", "iterations=2", "--no-pictures", "--set", "network.stack_size=1"),
        "newest": ("train", "--stop", "iterations=30", "--no-pictures"),
        "varied": (
            "train",
            "--from",
            "runs/newest",
            "--stop",
            "iterations=30",
            "--no-pictures",
            "--set",
            "variation.level=light",
        ),
    },
    "snake": {"learned": ("snakes", "train", "--snakes", "2", "--stop", "minutes=1")},
    "unity": {
        "basic": ("unity", "train", "builtin:Basic"),
        "basic-dqn": ("unity", "train", "builtin:Basic", "--algorithm", "dqn"),
    },
}
"""By path what a pupil types to train each of them."""
DRAWN = "[...document.querySelectorAll('[data-figure]:not(.field)')].every(one => one.children.length > 1)"


@pytest.fixture
def browser():
    one = Browser(390, 844, dark=True)
    one.page.emulate_media(color_scheme="dark", reduced_motion="reduce")
    yield one
    assert one.complaints == []
    one.close()


@pytest.fixture
def serve(progress):
    threads = []

    def begin(models=dict):
        threads.append(ServerThread(make_lessons(progress=progress, models=models), "test"))
        return f"http://127.0.0.1:{threads[-1].start('127.0.0.1', 0)}"

    yield begin
    for thread in threads:
        thread.close()


@pytest.mark.long
@pytest.mark.parametrize("path", TRAINED)
def test_a_path_is_walked_to_its_end_with_models_of_ones_own(browser, serve, tmp_path, progress, path):
    for name, words in TRAINED[path].items():
        command = [sys.executable, "-m", "racecraft", *words, "--run", f"runs/{name}", "--json"]
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    walk(Pupil(browser, serve(Workspace(tmp_path).newest_runs), OWN), path, progress)


@pytest.mark.parametrize("path", ["snake", "unity"])
def test_a_path_is_walked_by_keyboard_with_models_that_are_there(browser, serve, progress, models, path):
    walk(Pupil(browser, serve(lambda: models), {}), path, progress)


def walk(pupil, path, progress):
    """Do every exercise of a path."""
    for lesson in course().of_path(path):
        assert pupil.walk(lesson) == []
        assert pupil.browser.sideways() == 0
        assert progress.done(lesson.id) == len(lesson.exercises)


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    """One course in one browser, lesson after lesson: (address, browser, what was fetched)."""
    thread = ServerThread(make_lessons(progress=Progress(tmp_path_factory.mktemp("r") / "l.json"), models=dict), "test")
    one = Browser()
    one.page.emulate_media(reduced_motion="reduce")
    fetched = []
    one.page.on("request", lambda request: fetched.append(request.url))
    yield f"http://127.0.0.1:{thread.start('127.0.0.1', 0)}", one, fetched
    one.close()
    thread.close()


@pytest.mark.parametrize("lesson", course().lessons, ids=lambda lesson: lesson.id)
def test_a_lesson_is_read_by_everybody(reader, lesson):
    address, browser, fetched = reader
    fetched.clear()
    browser.show(1200)
    browser.open(f"{address}/lessons/{lesson.id}")
    browser.until(DRAWN)
    for width, dark in ((1200, False), (390, True)):
        browser.show(width, dark=dark)
        assert browser.shut_out() == []
        assert browser.sideways() == 0
    assert browser.complaints == []
    assert f"{address}/lessons/{lesson.id}" in fetched
    assert all(one.startswith((address, "data:")) for one in fetched), "no network"


def test_where_motion_is_reduced_a_recorded_training_shows_its_end_at_once(browser, serve):
    browser.open(f"{serve()}/lessons/car")
    browser.until(DRAWN)
    browser.page.get_by_role("button", name="Play all").click()
    assert browser.value("document.querySelector('[data-figure] .facts').innerText").split()[:2] == ["20", "iteration"]

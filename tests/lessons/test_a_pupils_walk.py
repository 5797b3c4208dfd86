"""The ninety minutes, walked to their end by keyboard alone on a phone's width, and each page read by everybody."""

import subprocess
import sys

import pytest
from tests.browser import Browser, needs_chromium
from tests.lessons.pupil import Pupil

from racecraft.console.workspace import Workspace
from racecraft.lessons.course import course
from racecraft.lessons.service import make_lessons
from racecraft.web.server import ServerThread

pytestmark = needs_chromium
OWN = {
    "race/own-lap": {"car": "newest"},
    "race/one-change": {"before": "first", "after": "newest", "expected": "undo", "reason": "keep"},
    "race/beat-the-first": {"first": "first", "own": "newest"},
}
TRAINED = {"first": "2", "newest": "30"}
"""Iterations of a pupil's two cars."""
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
def test_the_ninety_minutes_are_walked_to_their_end_by_keyboard(browser, serve, tmp_path, progress):
    for name, iterations in TRAINED.items():
        words = ["train", "--run", f"runs/{name}", "--stop", f"iterations={iterations}", "--no-pictures", "--json"]
        subprocess.run([sys.executable, "-m", "racecraft", *words], cwd=tmp_path, check=True, capture_output=True)
    pupil = Pupil(browser, serve(Workspace(tmp_path).newest_runs), OWN)
    for lesson in course().of_path("car"):
        assert pupil.walk(lesson) == []
        assert browser.sideways() == 0
        assert progress.done(lesson.id) == len(lesson.exercises)


@pytest.mark.parametrize("path", ["snake", "unity"])
def test_a_path_is_walked_as_far_as_it_goes_by_keyboard(browser, serve, progress, path):
    pupil = Pupil(browser, serve(), {})
    for lesson in course().of_path(path):
        assert pupil.walk(lesson) == []
        assert browser.sideways() == 0
        assert progress.done(lesson.id) == len(lesson.exercises)


@pytest.mark.parametrize("lesson", course().lessons, ids=lambda lesson: lesson.id)
def test_a_lesson_is_read_by_everybody(browser, serve, lesson):
    address = serve()
    for width, dark in ((1200, False), (390, True)):
        browser.show(width, 900, dark)
        browser.open(f"{address}/lessons/{lesson.id}")
        browser.until(
            "[...document.querySelectorAll('[data-figure]:not(.field)')].every(one => one.children.length > 1)"
        )
        assert browser.shut_out() == []
        assert browser.sideways() == 0

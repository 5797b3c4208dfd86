"""A course whose record of what is done lies in the test's own folder."""

from pathlib import Path

import pytest

from racecraft.lessons.course import course
from racecraft.lessons.progress import Progress
from racecraft.lessons.service import Lessons, checked
from racecraft.worlds.deepracer.lessons import racing
from racecraft.worlds.unity.lessons import trained

CARS = {
    "first": racing.Raced([9.0, 9.1, 9.2], 0),
    "as fast": racing.Raced([8.95, 9.3, 9.2], 0),
    "faster": racing.Raced([8.0, 8.1, 8.2], 1),
    "lost": racing.Raced([], 40),
}
"""What cars of a pupil did in a race that is not driven here."""
SCENES = {
    "right": trained.Judged(0.93, "ppo"),
    "left": trained.Judged(0.07, "ppo"),
    "idle": trained.Judged(-2.0, "ppo"),
    "by dqn": trained.Judged(0.93, "dqn"),
    "idle dqn": trained.Judged(-2.0, "dqn"),
}
"""What a pupil's models of Basic reach in episodes that are not played here."""


@pytest.fixture
def progress(tmp_path):
    return Progress(tmp_path / "lessons.json")


@pytest.fixture
def models(monkeypatch):
    """Return a pupil's models, whose races and episodes are told in place of run; the long walks run real ones."""
    monkeypatch.setattr(racing, "raced", lambda cars: {name: CARS[run.name] for name, run in cars.items()})
    monkeypatch.setattr(trained, "judged", lambda run: SCENES[run.name])
    monkeypatch.setattr(trained, "compared", lambda run: trained.Compared(50, 50, "Connection refused"))
    return {name: Path(name) for name in (*CARS, *SCENES)}


@pytest.fixture
def answer(progress, models):
    """Return a function that answers an exercise as a page does: ("grid/best-drive", field=value, …)."""

    def give(where, **given):
        lessons = Lessons(lambda request, template, title, **data: None, progress, models=lambda: models)
        return checked(lessons, *where.split("/"), given)

    return give


@pytest.fixture(scope="session")
def whole_course():
    return course()

"""A course whose record of what is done lies in the test's own folder."""

from pathlib import Path

import pytest

from racecraft.lessons.course import course
from racecraft.lessons.progress import Progress
from racecraft.lessons.service import Lessons, checked
from racecraft.worlds.battlesnake.lessons import matches
from racecraft.worlds.battlesnake.lessons.duel import Duel
from racecraft.worlds.deepracer.lessons import disturbed, racing
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
DRIVEN = {
    "first": racing.Driven(1.5, 0.1, 4.0), "as fast": racing.Driven(1.51, 0.1, 4.0),
    "faster": racing.Driven(2.0, 0.2, 3.0), "lost": racing.Driven(1.0, 0.3, 9.0),
}  # fmt: skip
LATE = {"first": [20, 30, 40, 50, 60], "as fast": [100] * 5, "faster": [30, 40, 50, 60, 50], "lost": [9] * 5}
DUELS = {
    "first": Duel(2, 18, 2000, 0, ""), "as fast": Duel(9, 11, 2000, 0, ""), "faster": Duel(15, 5, 2000, 0, ""),
    "lost": Duel(0, 20, 100, 9, "no move"),
}  # fmt: skip
THREE = ["reinvent_base", "Oval_track", "Bowtie_track"]
ON_TRACK = {
    "first": (["reinvent_base"], [9.0] * 5), "as fast": (THREE, [50.0] * 5),
    "faster": (THREE, [100.0, 100.0, 100.0, 40.0, 50.0]), "lost": (THREE, [9.0] * 5),
}  # fmt: skip


@pytest.fixture
def progress(tmp_path):
    return Progress(tmp_path / "lessons.json")


@pytest.fixture
def models(monkeypatch):
    """Return a pupil's models, whose races and episodes are told in place of run; the long walks run real ones."""
    monkeypatch.setattr(racing, "raced", lambda cars: {name: CARS[run.name] for name, run in cars.items()})
    monkeypatch.setattr(trained, "judged", lambda run: SCENES[run.name])
    monkeypatch.setattr(trained, "compared", lambda run: trained.Compared(50, 50, "Connection refused"))
    monkeypatch.setattr(racing, "driven", lambda run: DRIVEN[run.name])
    monkeypatch.setattr(disturbed, "late_drives", lambda run: LATE[run.name])
    monkeypatch.setattr(disturbed, "on_track", lambda run, track: ON_TRACK[run.name])
    monkeypatch.setattr(matches, "learned_duel", lambda code, run: DUELS[run.name])
    monkeypatch.setattr(matches, "searched", lambda run: [(30, 3), (120, 4)])
    monkeypatch.setattr(disturbed, "pack", lambda run: {"checked_on": 20, "small_frames_alike": 0.9})
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

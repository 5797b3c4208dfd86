"""A course whose record of what is done lies in the test's own folder."""

import pytest

from racecraft.lessons.course import course
from racecraft.lessons.progress import Progress
from racecraft.lessons.service import Lessons, checked


@pytest.fixture
def progress(tmp_path):
    return Progress(tmp_path / "lessons.json")


@pytest.fixture
def answer(progress):
    """Return a function that answers an exercise as a page does: ("grid/best-drive", field=value, …)."""

    def give(where, **given):
        lessons = Lessons(lambda request, template, title, **data: None, progress)
        return checked(lessons, *where.split("/"), given)

    return give


@pytest.fixture(scope="session")
def whole_course():
    return course()

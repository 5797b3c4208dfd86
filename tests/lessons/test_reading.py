"""A text becomes a lesson; what is wrong in one is named with its line; every sentence can be translated."""

import re
from importlib.resources import files

import pytest

from racecraft.contract.errors import InputFileError
from racecraft.lessons.reading import messages, read_lesson
from racecraft.training.glossary import WORDS

FRONT = "---\nid: a\nnumber: 1\ntitle: A\ngoal: G.\nminutes: 3\npath: car\n---\n"


def test_a_directive_becomes_a_block_with_its_fields():
    fields = "number n: 0..3 How many\nlater choice why: Why?\noption why a: So\nwhen low: Up.\n"
    text = FRONT + ":::{exercise} x\ncheck: total_is total=2.2\nask: Do\n  it.\n" + fields + ":::\n"
    (exercise,) = read_lesson(text, "a.md").exercises
    assert (exercise.number, exercise.ask, exercise.arguments) == ("1.1", "Do it.", {"total": 2.2})
    number, reason = exercise.fields
    assert (number.low, number.high, number.label) == (0, 3, "How many")
    assert reason.later
    assert reason.options == {"a": "So"}


@pytest.mark.parametrize(
    ("body", "line"),
    [
        (":::{exercise} x\nask: Do it.\n:::\n", 9),
        (":::{figure} x\nno key\n:::\n", 10),
        (":::{exercise} x\nnumber n: 3\n:::\n", 10),
    ],
)
def test_what_is_wrong_is_named_with_its_line(body, line):
    with pytest.raises(InputFileError) as caught:
        read_lesson(FRONT + body, "a.md")
    assert f"a.md:{line}" in str(caught.value)


def test_every_sentence_of_a_lesson_is_in_the_catalogue(monkeypatch, whole_course):
    """With every message in capitals nothing that a pupil reads stays as it is written."""
    monkeypatch.setattr("racecraft.lessons.reading.translate", str.upper)
    text = (files("racecraft.lessons") / "texts" / "04-explore.md").read_text("utf-8")
    found = {message for _, message in messages(text, "explore.md")}
    lesson = read_lesson(text, "explore.md")
    shown = [lesson.title, lesson.goal]
    for one in lesson.exercises:
        shown += [one.ask, one.hint, one.worked, one.why, one.heads, *one.cases.values()]
        shown += [text for field in one.fields for text in (field.label, *field.options.values())]
    known = {message.upper() for message in found}
    assert all(part in known for part in shown if part)
    assert whole_course.find("explore").exercises[0].ask not in shown


def test_every_word_that_a_lesson_marks_has_a_meaning_and_stands_in_its_text(whole_course):
    known = {word.name for word in WORDS}
    for lesson in whole_course.lessons:
        assert set(lesson.words) <= known, lesson.id
        text = re.sub(r"\W+", " ", str(lesson).casefold())
        for word in lesson.words:
            names = [re.sub(r"\W+", " ", part).strip() for part in word.casefold().rstrip(")").split("(")]
            assert any(name.rstrip("s") in text for name in names), (lesson.id, word)

"""Every exercise: a right answer passes, each listed misconception gets its own feedback, chance passes rarely."""

import random

import pytest
from tests.lessons.answers import CASES, LAP, RIGHT, TRAINED, random_take

from racecraft.lessons.checking import Answer, material
from racecraft.lessons.course import course

EXERCISES = {f"{lesson.id}/{one.id}": one for lesson in course().lessons for one in lesson.exercises}
DONE = ("passed", "seen")


def test_every_exercise_has_a_right_answer_and_one_for_each_misconception():
    assert set(RIGHT) == set(EXERCISES)
    for where, exercise in EXERCISES.items():
        assert set(CASES.get(where, {})) == set(exercise.cases), where


def test_every_check_belongs_to_an_exercise():
    assert {exercise.check for exercise in EXERCISES.values()} == set(course().checks)


def test_the_texts_of_lessons_9_and_11_fit_the_recorded_cars():
    late = {(one["rate"], one["seed"]): sum(one["training"][-5:]) / 5 for one in recorded("curves.json")["rows"]}
    for seed in (1, 2, 3):
        assert late["3e-5", seed] < 20 < late["3e-4", seed] < late["3e-3", seed]
    columns, (*alone, three) = (recorded("tracks.json")[name] for name in ("columns", "rows"))
    assert all(one["full_laps"][columns.index(one["trained"])] == 5 for one in alone), "each laps its own track"
    assert TRAINED["three_new"] >= 1
    best = map(max, *(one["progress"] for one in alone))
    assert all(own >= other for own, other in zip(three["progress"], best, strict=True)), "three roads beat one"


def recorded(name):
    return material("racecraft.worlds.deepracer.lessons", name)


def test_the_texts_of_lesson_8_fit_the_recorded_lap():
    assert EXERCISES["sight/undecided"].fields[0].high == len(LAP)
    seen = recorded("sight.json")
    mirrored = seen["pictures"][TRAINED["mirror"] - 1]["mirrored"]
    assert seen["actions"][mirrored.index(max(mirrored))].startswith("left"), "it goes on steering left"
    assert TRAINED["turned"], "and elsewhere it does not"


@pytest.mark.parametrize("where", EXERCISES)
def test_a_right_answer_passes(answer, where):
    told = answer(where, **RIGHT[where])
    assert told["state"] in DONE, told
    assert told["text"]
    heads, rows = told["table"] or ([], [])
    assert all(len(row) == len(heads) for row in rows), told
    assert "{" not in f"{told['text']}{heads}"


@pytest.mark.parametrize(("where", "case"), [(where, case) for where in CASES for case in CASES[where]])
def test_a_misconception_gets_its_own_feedback(answer, where, case):
    told = answer(where, **CASES[where][case])
    assert told["state"] not in DONE
    assert told["case"] == case, told
    assert told["text"]
    assert "{" not in told["text"]


KINDS = {where: {field.kind for field in one.fields} for where, one in EXERCISES.items()}
TASKS = [where for where, one in EXERCISES.items() if one.kind == "task" and "model" not in KINDS[where]]
"""A trained car is nothing that can be drawn at random."""
HEAVY = {"explore/schedule", "gradient/drives-needed", "reward/long-road"}
"""Each try runs for long: their chances are the long tests'."""


@pytest.mark.parametrize("where", [pytest.param(w, marks=pytest.mark.long) if w in HEAVY else w for w in TASKS])
def test_random_answers_pass_rarely(where):
    exercise, check = EXERCISES[where], course().checks[EXERCISES[where].check]
    rng = random.Random(where)
    tries = 1 if "code" in KINDS[where] else 100 if where in HEAVY else 1000
    lucky = sum(check(Answer(exercise, at_random(exercise, rng))).state in DONE for _ in range(tries))
    assert lucky <= 0.05 * tries


def at_random(exercise, rng):
    given = {}
    for one in exercise.fields:
        if one.kind == "number":
            given[one.name] = f"{rng.uniform(one.low, one.high):.2f}"
        elif one.kind == "choice":
            given[one.name] = rng.choice(list(one.options))
        elif one.kind == "code":  # as it stands in the field
            given[one.name] = one.code
        else:
            given[one.name] = random_take(exercise, one.name, rng)
    return given


@pytest.mark.parametrize("where", EXERCISES)
def test_no_answer_is_no_try(answer, progress, where):
    told = answer(where)
    assert told["state"] == "unusable"
    assert told["text"]
    assert progress.of(where.split("/")[0]) == {}

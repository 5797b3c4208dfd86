"""A verdict says no more than its seeds and its settings allow."""

import math

import pytest

from racecraft.evaluation.fresh_starts import FreshScores
from racecraft.evaluation.run_groups import Difference
from racecraft.evaluation.verdict import ScoredGroup, verdict_of

REWARD = Difference("reward function", ("a1", "b2"))
SPEED = Difference("ppo.learning_rate", (1e-3, 1e-4))


def laps(name, *seconds, progress=100.0):
    """Return a group whose seeds each drove the same lap from five starts."""
    return ScoredGroup(name, tuple(FreshScores("lap time, s", True, (one,) * 5, 7, progress) for one in seconds))


def told(*groups, differing=(REWARD,)):
    """Return the sentences as one text."""
    return " ".join(verdict_of(groups, differing).sentences)


def test_three_clean_seeds_against_three_are_once_in_twenty_and_one_setting_is_the_cause():
    text = told(laps("speed", 6.0, 6.2, 6.1), laps("centre", 9.0, 9.5, 8.0))
    assert "Better: speed (lap time 6.10 s against 8.92 s, by 2.82 s)." in text
    assert "Each of its three seeds beats every seed of centre." in text
    assert "luck alone does that once in 20." in text
    assert text.endswith("One setting differs, reward function: where it is not luck, that made the difference.")


def test_where_two_settings_differ_the_cause_cannot_be_told():
    text = told(laps("a", 6.0, 6.2, 6.1), laps("b", 9.0, 9.5, 8.0), differing=(REWARD, SPEED))
    assert "Two settings differ (reward function, ppo.learning_rate): the cause cannot be told." in text
    assert "its doing" not in text


def test_where_nothing_differs_it_is_luck():
    assert "No setting differs: what you see is luck." in told(laps("a", 6.0), laps("b", 9.0), differing=())


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        ((6.0,), (9.0,), "One seed a side tells nothing"),
        ((6.0, 6.1), (9.0, 9.1), "No verdict. a looks better"),
        ((6.0, 6.1), (9.0, 9.1), "luck alone does that once in 6. More seeds would tell"),
        ((6.0, 6.2, 6.4, 6.6, 6.8), (6.1, 6.3, 6.5, 6.7, 6.9), "More seeds would tell (--seeds 10)."),
        ((6.0, 6.1, 9.9), (6.2, 6.3, 6.4), "No verdict. a wins more pairs of seeds but has the worse mean"),
        ((6.0, 7.0), (7.0, 6.0), "No difference between"),
    ],
)
def test_few_or_mixed_seeds_bring_no_verdict(a, b, words):
    found = verdict_of((laps("a", *a), laps("b", *b)), (REWARD,))
    assert words in " ".join(found.sentences)
    assert not found.is_clear
    assert "its doing" not in " ".join(found.sentences)


def test_a_seed_that_does_not_lap_is_worse_than_any_that_does():
    found = verdict_of((laps("a", math.inf, math.inf, 20.0), laps("b", 25.0, 26.0, 27.0)), (REWARD,))
    assert found.order[0] == 1
    assert "lap time 26.00 s against no lap" in found.sentences[0]


def test_where_no_seed_laps_progress_is_compared():
    a, b = laps("a", *[math.inf] * 3, progress=40.0), laps("b", *[math.inf] * 3, progress=70.0)
    found = verdict_of((a, b), (REWARD,))
    assert found.measure.name == "progress"
    assert "Better: b (progress 70.00 % against 40.00 %, by 30.00 %)." in found.sentences[0]


def test_one_group_is_told_with_its_spread():
    assert "One seed tells nothing of the next one." in told(laps("a", 6.0), differing=())
    text = told(laps("a", 6.0, 7.0, 6.5, 6.4), differing=())
    assert "interquartile mean of four seeds; the best 6.00 s, the worst 7.00 s." in text


def test_a_group_that_does_not_lap_says_so():
    text = told(laps("a", math.inf, math.inf, 7.0), differing=())
    assert text == "a: two of three seeds bring no lap; the best 7.00 s, the worst no lap."


def test_half_of_the_starts_without_a_lap_are_no_lap():
    assert FreshScores("lap time, s", True, (6.0, 6.2, math.inf, math.inf), 1, 60.0).score == math.inf
    assert FreshScores("lap time, s", True, (6.0, 6.2, 6.4, math.inf), 1, 60.0).score == pytest.approx(6.3)
    assert FreshScores("return", False, (10.0, 20.0), 1, 15.0).score == 15.0

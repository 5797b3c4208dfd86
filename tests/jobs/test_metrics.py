"""Figures out of a log, with the time at which they were said."""

import pytest

from racecraft.contract.errors import SettingError
from racecraft.jobs.follow import follow, last_words
from racecraft.jobs.metrics import check_definitions, read_metrics
from racecraft.sagemaker.estimator_config import RLToolkit, default_metric_definitions

RAY = default_metric_definitions(RLToolkit.RAY)


def test_figures_of_a_ray_log_come_with_their_times(tmp_path):
    log, times = tmp_path / "log.txt", tmp_path / "log_times.txt"
    first = "  episode_reward_max: 9.0\n  episode_reward_mean: -1.5e-01\n"
    log.write_text(first + "nothing\n  episode_reward_mean: nan\nepisode_reward_mean: 20\n")
    times.write_text(f"100.00 {len(first)}\n107.50 {log.stat().st_size}\n")
    told = [(one.name, one.time, one.value) for one in read_metrics(log, times, RAY)]
    assert told == [
        ("episode_reward_max", 100.0, 9.0),
        ("episode_reward_mean", 100.0, -0.15),
        ("episode_reward_mean", 107.5, 20.0),
    ]


def test_figures_of_a_coach_log(tmp_path):
    log = tmp_path / "log.txt"
    log.write_text("Training> Name=main, Worker=0, Episode=1, Total reward=19.0, Exploration=0.1\n")
    told = read_metrics(log, tmp_path / "none", default_metric_definitions("coach"))
    assert [(one.name, one.value) for one in told] == [("reward-training", 19.0)]


@pytest.mark.parametrize(
    ("wrong", "letter"),
    [
        ({"Name": "a"}, "expected {'Name'"),
        ({"Name": "a", "Regex": "reward=.*"}, "has no group"),
    ],
)
def test_a_definition_that_finds_nothing_is_refused_at_once(wrong, letter):
    with pytest.raises(SettingError, match=letter):
        check_definitions([wrong])


def test_a_log_is_followed_to_its_last_half_line(tmp_path):
    log = tmp_path / "log.txt"
    told, seen = iter(["one\ntw", "o\nthr", "ee"]), []

    def ended():
        text = next(told, None)
        if text is not None:
            with open(log, "a") as file:
                file.write(text)
        return text is None

    for text in follow(log, ended, look_seconds=0.0):
        seen.append(text)
    assert seen == ["one\n", "two\n", "three"]


def test_the_last_words_are_the_letter_or_the_error(tmp_path):
    log = tmp_path / "log.txt"
    log.write_text("iteration 1\nracecraft: ppo has no setting 'x'.\n")
    assert last_words(log) == "racecraft: ppo has no setting 'x'."
    log.write_text("iteration 1\nTraceback (most recent call last):\n  File \"x.py\", line 1\nKeyError: 'lr'\n")
    assert last_words(log) == "KeyError: 'lr'"
    assert last_words(tmp_path / "none") == ""

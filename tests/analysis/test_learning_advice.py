"""Every rule of advice: a training in which it holds, and one in which it does not."""

import re

import numpy as np
import polars as pl
import pytest
from tests.logs import makers

from racecraft.algorithms.registry import find_algorithm
from racecraft.analysis.deepracer.logs.advice import advice
from racecraft.analysis.learner import Learner, learner_of_job, learner_of_log
from racecraft.analysis.learning_advice import learning_advice
from racecraft.analysis.report import write_report
from racecraft.formats.run_folder import RunFolder
from racecraft.logs import read
from racecraft.reporting.account import advice_of, as_asked
from racecraft.settings.overrides import as_dictionary
from racecraft.tracks.catalogue import load_track
from racecraft.training.deepracer.presets import default_settings

COUNT = 20
PPO = Learner("ppo", {"ppo": {"learning_rate": 4e-4, "entropy_weight": 0.02}, "rollout": {"horizon": 64}})


def metrics_of(**columns):
    """Return COUNT lines of metrics of a healthy training, with some columns changed."""
    at = np.arange(COUNT)
    healthy = {
        "entropy": 2.3 - 0.05 * at, "evaluation_score": 4.0 * at, "approx_kl": np.full(COUNT, 0.01),
        "explained_variance": np.full(COUNT, 0.8),
    }  # fmt: skip
    table = {"iteration": at + 1, "steps": 1000 * (at + 1), "seconds": 2.0 * (at + 1), **healthy, **columns}
    return [{name: float(values[k]) for name, values in table.items()} for k in range(COUNT)]


EARLY = np.where(np.arange(COUNT) < 5, 2.3, 0.2)
LATE = np.where(np.arange(COUNT) < 15, 2.3, 0.2)
FELL = np.concatenate([np.linspace(0, 90, 12), np.linspace(80, 20, 8)])
RULES = {
    "exploration": ("Exploration ended too soon", {"entropy": EARLY}, {"entropy": LATE}),
    "exploration, though it laps": (
        "Exploration ended too soon", {"entropy": EARLY}, {"entropy": EARLY, "evaluation_score": 5.2 * np.arange(COUNT)}
    ),
    "exploration of numbers": (
        "Exploration ended too soon", {"entropy": EARLY}, {"entropy": EARLY - 1.0}
    ),
    "forgetting": ("It forgot", {"evaluation_score": FELL}, {"evaluation_score": np.sort(FELL)}),
    "far steps": ("go too far", {"approx_kl": np.full(COUNT, 0.2)}, {"approx_kl": np.full(COUNT, 0.02)}),
    "blind critic, though it laps": (
        "critic learns nothing", {"explained_variance": np.full(COUNT, 0.05)},
        {"explained_variance": np.full(COUNT, 0.05), "evaluation_score": 5.2 * np.arange(COUNT)},
    ),
    "blind critic": (
        "critic learns nothing", {"explained_variance": np.full(COUNT, 0.05)},
        {"explained_variance": np.linspace(0, 0.9, COUNT)},
    ),
}  # fmt: skip


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_of_the_learner_speaks_where_it_holds_and_only_there(rule):
    words, holds, does_not = RULES[rule]
    found = [one for one in learning_advice(metrics_of(**holds), PPO, 100.0) if words in one.try_]
    assert len(found) == 1
    assert found[0].command.startswith("racecraft ")
    assert found[0].plot()._repr_png_()[:4] == b"\x89PNG"
    assert not [one for one in learning_advice(metrics_of(**does_not), PPO, 100.0) if words in one.try_]


def test_a_healthy_and_a_short_training_get_no_advice():
    assert learning_advice(metrics_of(), PPO, 100.0) == []
    assert learning_advice(metrics_of(entropy=EARLY)[:9], PPO, 100.0) == []


def commands(learner, **changed):
    return [one.command for one in learning_advice(metrics_of(**changed), learner, 100.0)]


def test_advice_goes_on_from_the_run_s_own_settings():
    assert commands(PPO, entropy=EARLY) == ["racecraft train --set ppo.entropy_weight=0.06"]
    assert commands(PPO, evaluation_score=FELL) == ["racecraft train --from RUN:best --set ppo.learning_rate=0.0002"]
    assert commands(PPO, explained_variance=np.zeros(COUNT)) == ["racecraft train --set rollout.horizon=128"]


@pytest.mark.parametrize("algorithm", ["sac", "dqn", "apex", "reinforce", "es"])
@pytest.mark.parametrize("kind", ["deepracer", "gymnasium", "battlesnake", "unity"])
def test_advice_names_no_setting_of_another_algorithm(algorithm, kind):
    settings = as_dictionary(default_settings(find_algorithm(algorithm)))
    learner = learner_of_job({"algorithm": algorithm, "settings": settings})
    asked = {"environment": "CartPole-v1", "build": "builtin:Basic", "game": {"players": 2}, "track": "Oval_track"}
    found = commands(learner, entropy=EARLY, evaluation_score=FELL, explained_variance=np.zeros(COUNT))
    assert found
    for command in found:
        typed = as_asked(command, {"kind": kind, "algorithm": algorithm, "asked": asked})
        assert f"--algorithm {algorithm}" in typed
        named = re.findall(r"--set (\w+)\.", typed)
        assert set(named) <= {algorithm, "rollout"}
    assert not [command for command in found if "entropy_weight" in command] or algorithm == "reinforce"


def test_the_learner_of_a_log_is_told_by_its_hyperparameters():
    console = learner_of_log({"hyperparameters": {"lr": 0.0003, "beta_entropy": 0.01}})
    assert console.smaller_steps() == " --set ppo.learning_rate=0.00015"
    assert learner_of_log({"hyperparameters": {"lr": 0.001, "sac_alpha": 0.2}}).smaller_steps() == (
        " --set sac.learning_rate=0.0005"
    )
    assert learner_of_log({}).smaller_steps() == ""


# --- of the log -------------------------------------------------------------------------------------------------------


def ticks_of(tmp_path, episodes):
    return read(makers.write(tmp_path / "0-iteration.csv", makers.joined(*episodes))).ticks.collect()


def told(ticks, words):
    found = [one for one in advice(ticks, load_track("reinvent_base")) if words in one.try_]
    for one in found:
        assert one.plot()._repr_png_()[:4] == b"\x89PNG"
    return found


def test_a_corner_that_takes_half_of_the_exits(tmp_path):
    same = [makers.episode(k, 0.3, ticks=20) for k in range(24)]
    spread = [makers.episode(k, 0.1 + 0.85 * k / 24, ticks=20) for k in range(24)]
    (found,) = told(ticks_of(tmp_path / "a", same), "Pay for the right line or less speed in")
    assert "takes" in found.found
    evenly = ticks_of(tmp_path / "b", spread)
    assert not told(evenly.filter(pl.col("status") != "off_track"), "Pay for the right line")


def test_speed_that_is_not_used_on_straights(tmp_path):
    episodes = [makers.episode(k, 1.0, ticks=60, status="lap_complete") for k in range(20)]
    slow = ticks_of(tmp_path, episodes).with_columns(speed_mps=pl.when(pl.col("tick") == 5).then(4.0).otherwise(1.0))
    assert told(slow, "Speed is not used")
    assert not told(slow.with_columns(speed_mps=pl.lit(4.0)), "Speed is not used")


def test_a_reward_that_has_nothing_to_do_with_progress(tmp_path):
    shares = np.linspace(0.1, 0.9, 24)
    fair = [makers.episode(k, share, ticks=20, reward=share) for k, share in enumerate(shares)]
    unfair = [makers.episode(k, share, ticks=20, reward=1.0 - share) for k, share in enumerate(shares)]
    words = "paid for something else than coming forward"
    assert told(ticks_of(tmp_path / "a", unfair), words)
    assert not told(ticks_of(tmp_path / "b", fair), words)


def test_a_page_has_the_account_of_a_run_in_plain_words(tmp_path):
    run = RunFolder.create(
        tmp_path / "run", {"kind": "gymnasium", "title": "CartPole-v1", "algorithm": "ppo", "settings": {},
                           "asked": {"stops": ["minutes=1"], "environment": "CartPole-v1"}},
    )  # fmt: skip
    for row in metrics_of(evaluation_score=FELL):
        run.append_metrics(row)
    text = write_report(run, tmp_path / "r.html", advice=advice_of(run)).read_text(encoding="utf-8")
    assert "PPO was asked to play CartPole-v1, until minutes=1." in text
    assert "it went from 0 to 90 in iteration 12" in text
    assert "What to try next" in text
    assert f"racecraft gym train CartPole-v1 --from {run.path}:best" in text
    assert text.index("It forgot") < text.index("How it learned")

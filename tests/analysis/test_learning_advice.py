"""Every rule of advice: a training in which it holds, and one in which it does not."""

import re
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from tests.worlds.deepracer.logs import makers

from racecraft.algorithms.registry import find_algorithm
from racecraft.analysis.learner import Learner, learner_of_job, learner_of_log
from racecraft.analysis.learning_advice import learning_advice
from racecraft.analysis.report import write_report
from racecraft.analysis.run_advice import typed_command
from racecraft.analysis.run_facts import read_facts
from racecraft.analysis.run_summary import happened_words, request_text
from racecraft.formats.episodes import STATUSES
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.overrides import as_dictionary
from racecraft.worlds.deepracer.analysis.logs.advice import advice
from racecraft.worlds.deepracer.analysis.logs.judged import Evaluations
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.presets import default_settings

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
    "forgetting, though there was little": (
        "It forgot", {"evaluation_score": FELL}, {"evaluation_score": FELL / 15.0}
    ),
    "paid more for less": (
        "was paid more for it",
        {"evaluation_score": FELL, "mean_reward": np.linspace(50, 90, COUNT)},
        {"evaluation_score": FELL, "mean_reward": np.linspace(90, 50, COUNT)},
    ),
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
def test_advice_names_no_setting_of_another_algorithm(algorithm):
    settings = as_dictionary(default_settings(find_algorithm(algorithm)))
    learner = learner_of_job({"algorithm": algorithm, "settings": settings})
    found = commands(learner, entropy=EARLY, evaluation_score=FELL, explained_variance=np.zeros(COUNT))
    assert found
    for command in found:
        typed = typed_command(command, {"kind": "deepracer", "algorithm": algorithm, "asked": {"track": "Oval_track"}})
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


def told(ticks, words, judged=None):
    found = [one for one in advice(ticks, load_track("reinvent_base"), judged=judged) if words in one.try_]
    for one in found:
        assert one.plot()._repr_png_()[:4] == b"\x89PNG"
    return found


def test_a_car_that_runs_into_boxes_is_not_told_of_the_road(tmp_path):
    ended = pl.col("status").cast(pl.String).replace("off_track", "crashed").cast(pl.Enum(STATUSES))
    left = ticks_of(tmp_path, [makers.episode(k, 0.3, ticks=20) for k in range(24)])
    crashed = left.with_columns(ended.alias("status"))
    (found,) = told(crashed, "Pay for keeping clear of what stands in the way or less speed in")
    assert re.search(
        r"(\d+) of \1 exits of the last two fifths, \1 of them crashes, lie in turn .* where they crash\.", found.found
    )
    assert not told(crashed, "the right line")


ROUND, SHORT = Evaluations((0.3, 1.0, 1.0), 21.5), Evaluations((0.3, 1.0, 0.9), 21.5)


def test_what_a_car_that_gets_round_did_while_it_explored_is_no_fault(tmp_path):
    """Exits at one corner and a reward against progress, in training; whether they matter the evaluations say."""
    same = ticks_of(tmp_path, [makers.episode(k, 0.3, ticks=20, reward=1.0 - k / 40) for k in range(40)])
    same = same.with_columns(iteration=pl.col("episode") // 20)
    for words in ("Pay for the right line or less speed in", "It is early"):
        assert told(same, words, SHORT)
        assert not told(same, words, ROUND)
    (found,) = told(same, "It laps", ROUND)
    assert found.found.startswith(
        "Judged without exploration, its last 2 evaluations came to 100 % and 100 % of a lap. Its best lap took "
        "21.50 s. While it explored, mean progress went from 30 % in"
    )
    assert not told(same, "It laps", SHORT)


def test_a_reward_that_has_nothing_to_do_with_progress(tmp_path):
    shares = np.linspace(0.1, 0.9, 24)
    fair = [makers.episode(k, share, ticks=20, reward=share) for k, share in enumerate(shares)]
    unfair = [makers.episode(k, share, ticks=20, reward=1.0 - share) for k, share in enumerate(shares)]
    words = "paid for something else than coming forward"
    (found,) = told(ticks_of(tmp_path / "a", unfair), words)
    assert found.found.startswith("Episodes that get farther are paid less (-1.00 between")
    assert advice(ticks_of(tmp_path / "c", unfair), None)[0].try_ == found.try_  # what is wrong with it comes first
    assert not told(ticks_of(tmp_path / "b", fair), words)
    assert not told(ticks_of(tmp_path / "d", unfair), words, ROUND), "a car that gets round is left alone"


def test_a_page_has_the_account_of_a_run_in_plain_words(tmp_path):
    run = RunFolder.create(
        tmp_path / "run", {"kind": "gymnasium", "title": "CartPole-v1", "algorithm": "ppo", "settings": {},
                           "asked": {"stops": ["minutes=1"], "environment": "CartPole-v1"}},
    )  # fmt: skip
    for row in metrics_of(evaluation_score=FELL):
        run.append_metrics(row)
    text = write_report(run, tmp_path / "r.html").read_text(encoding="utf-8")
    assert "PPO was asked to play CartPole-v1 until 1 min are over." in text
    assert "it went from 0 to 90 in iteration 12" in text
    assert "What to try next" in text
    assert f"racecraft gym train CartPole-v1 --from {run.path}:best" in text
    assert text.index("It forgot") < text.rindex("How it learned")


TABLE = [{"steering_angle": angle, "speed": speed} for angle in (-30, 0, 20) for speed in (0.5, 1.0)]


def test_what_a_car_was_asked_and_what_happened_is_told_in_plain_words(tmp_path):
    metadata = {"action_space": TABLE, "sensor": ["STEREO_CAMERAS", "SECTOR_LIDAR"]}
    asked = {"folder": "my-car", "from": "runs/old", "set": ["ppo.clip=0.1"], "stops": ["minutes=5", "iterations=9"]}
    job = {"kind": "deepracer", "title": "reinvent", "algorithm": "ppo", "asked": asked, "notes": []}
    run = RunFolder.create(tmp_path / "run", {**job, "settings": {}, "model_metadata": metadata})
    run.reward_function.write_text("def reward_function(params):\n    return 1.0\n")
    for row in metrics_of(evaluation_score=np.linspace(1, 100, COUNT), best_lap_seconds=np.full(COUNT, 20.0)):
        run.append_metrics(row)
    facts = read_facts(run)
    assert request_text(facts) == (
        "PPO was asked to drive reinvent until 5 min are over or 9 iterations are done. The car saw by two cameras and "
        "a LiDAR in sectors and chose among 6 actions, from 30° right to 20° left, at 0.5 to 1 m/s. It was paid by the "
        "reward function of my-car. It began with the weights of runs/old. Set by hand: ppo.clip=0.1."
    )
    assert happened_words(facts).endswith("Its fastest lap took 20.00 s. It does not complete laps yet.")
    fell = [{**row, "evaluation_score": 101.0 - row["evaluation_score"]} for row in facts.metrics]
    assert "came to 100 % of a lap in iteration 1.0, its first judgement and its best; the last was 1 % of a lap." in (
        happened_words(replace(facts, metrics=fell))
    )

"""Each key of hyperparameters.json, at a value that stands in no template, trains."""

import json

import pytest

import racecraft as rc
from racecraft.worlds.deepracer.files.hyperparameters import NAMES

VALUES = {
    "batch_size": 48,
    "beta_entropy": 0.02,
    "discount_factor": 0.95,
    "e_greedy_value": 0.1,
    "epsilon_steps": 5000,
    "exploration_type": "e-greedy",
    "loss_type": "mean squared error",
    "lr": 0.0002,
    "num_episodes_between_training": 3,
    "num_epochs": 2,
    "stack_size": 2,
    "term_cond_avg_score": 60,
    "term_cond_max_episodes": 60,
    "sac_alpha": 0.3,
}
CONTINUOUS = {
    "action_space": {"steering_angle": {"low": -20, "high": 20}, "speed": {"low": 0.5, "high": 1}},
    "sensor": ["FRONT_FACING_CAMERA"],
    "version": "5",
}
QUICK = (
    "camera.width=40", "camera.height=30", "rollout.num_worlds=3", "rollout.horizon=16", "evaluation.episodes=1",
    "network.conv_filters=4", "network.conv_kernels=4", "network.conv_strides=4", "network.hidden_units=8",
    "runtime.threads=1",
)  # fmt: skip


@pytest.mark.parametrize("learner", ["ppo", "sac"])
@pytest.mark.parametrize("names", [[*VALUES], *(pytest.param([name], marks=pytest.mark.long) for name in VALUES)])
def test_all_keys_together_and_each_by_itself_train_end_to_end(tmp_path, names, learner):
    assert set(VALUES) == set(NAMES), "a new key wants a value here"
    (tmp_path / "hyperparameters.json").write_text(json.dumps({name: VALUES[name] for name in names}))
    if learner == "sac":
        (tmp_path / "model_metadata.json").write_text(json.dumps({**CONTINUOUS, "training_algorithm": "sac"}))
    trained = rc.train(
        "deepracer", folder=tmp_path, stops="iterations=1", run=tmp_path / "run", settings=QUICK, quiet=True
    )
    assert trained.summary()["iterations"] == 1

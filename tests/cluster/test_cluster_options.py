"""What `--cluster` may be given, who shares what, and what is said where it cannot be."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from typer.testing import CliRunner

from racecraft.algorithms.rollout_batch import RolloutBatch, concat_rows
from racecraft.cli.app import app
from racecraft.cluster.cluster_options import ClusterOptions, read_cluster
from racecraft.cluster.distribute import distribute
from racecraft.cluster.shares import shares_of
from racecraft.cluster.transport import ClusterError
from racecraft.compat.shims import foreign_names
from racecraft.contract.errors import MissingExtraError, SettingError
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest


@pytest.mark.parametrize(
    ("text", "asked"),
    [
        ("auto", ClusterOptions(None, "auto")),
        ("8@auto", ClusterOptions(8, "auto")),
        ("8@10.0.0.5:6379", ClusterOptions(8, "10.0.0.5:6379")),
    ],
)
def test_what_is_asked_is_read_and_told_again(text, asked):
    assert read_cluster(text) == asked
    assert str(asked) == text


@pytest.mark.parametrize("text", ["", "0", "-2", "2@", "@auto", "@", "x", "host:0", "host:99999", "0@auto", "a@auto"])
def test_what_is_none_of_it_is_named(text):
    with pytest.raises(SettingError, match="--cluster is"):
        read_cluster(text)


def test_shares_are_even_and_have_chance_of_their_own():
    shares = shares_of((10,), 4, seed=5)
    assert [share.num_worlds for share in shares] == [3, 3, 2, 2]
    assert shares[0].seed == 5
    assert len({share.seed for share in shares}) == 4


def train_over(cluster, run, *settings):
    request = GymRequest("CartPole-v1", run=run, overrides=("rollout.num_worlds=2", *settings))
    train(request, NullCallback(), lambda text: None, distribute(cluster))


def test_a_missing_ray_is_named_with_what_installs_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'racecraft\[cluster\]'"):
        train_over(2, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_wrong_setting_is_told_before_a_missing_ray(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(SettingError, match="no setting .batchsize."):
        train_over(2, tmp_path / "run", "ppo.batchsize=8")


def test_a_job_that_would_miss_ray_is_not_begun(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, ["gym", "train", "CartPole-v1", "--cluster=2", "--detach"])
    assert isinstance(told.exception, MissingExtraError)
    assert not list(tmp_path.iterdir())


def test_a_name_that_is_lent_to_old_scripts_is_no_cluster(tmp_path):
    with foreign_names(), pytest.raises(ClusterError, match="Inside `racecraft run`"):
        train_over(2, tmp_path / "run")


def a_batch(ticks, rows, cut=()):
    shown = np.arange(ticks * rows * 2, dtype=np.float32).reshape(ticks, rows, 2) + 1
    truncated = np.zeros((ticks, rows), bool)
    for t, r in cut:
        truncated[t, r] = True
    index = np.array([t * rows + r for t, r in cut], np.int64)
    return RolloutBatch(
        observations={"seen": shown},
        actions=np.ones((ticks, rows), np.int64),
        reward=shown[..., 0],
        terminated=np.zeros((ticks, rows), bool),
        truncated=truncated,
        active=np.ones((ticks, rows), bool),
        last_observations={"seen": shown[-1]},
        last_active=np.ones(rows, bool),
        columns={"noted": shown[..., 1]},
        action_mask=np.ones((ticks, rows, 3), bool),
        last_action_mask=np.ones((rows, 3), bool),
        final_index=index,
        final_observations={"seen": np.stack([shown[t, r] for t, r in cut])} if cut else {},
    )


def test_side_by_side_is_the_reverse_of_taking_rows():
    whole = a_batch(5, 6, cut=((1, 0), (1, 4), (3, 2), (4, 5)))
    parts = [whole.of_rows(np.arange(first, last)) for first, last in ((0, 2), (2, 3), (3, 6))]
    again = concat_rows(parts)
    for name, value in vars(whole).items():
        other = getattr(again, name)
        if isinstance(value, dict):
            assert value.keys() == other.keys()
            for key, array in value.items():
                assert_array_equal(array, other[key])
        else:
            assert_array_equal(value, other)


def test_rows_that_ended_sooner_stand_still_and_are_not_learned_from():
    long, short = a_batch(4, 2, cut=((3, 1),)), a_batch(2, 1, cut=((1, 0),))
    both = concat_rows([short, long])
    assert both.shape == (4, 3)
    assert_array_equal(both.active[:, 0], [True, True, False, False])
    assert both.action_mask.all()  # who stands still may do anything
    assert_array_equal(both.final_index, [1 * 3 + 0, 3 * 3 + 2])
    assert_array_equal(
        both.final_observations["seen"], [short.observations["seen"][1, 0], long.observations["seen"][3, 1]]
    )
    assert_array_equal(
        both.last_observations["seen"], [*short.last_observations["seen"], *long.last_observations["seen"]]
    )

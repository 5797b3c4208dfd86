"""A car that learned alone goes among others, and back: what its network keeps, and what is refused."""

import shutil

import numpy as np
import pytest
from tests.worlds.deepracer.training.test_run_env_effects import SMALL

from racecraft.contract.errors import RunFolderError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.players.trained import load_policy
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.env.race import CRITIC_OBJECT_NUMBERS
from racecraft.worlds.deepracer.export.car_model import export_to_car
from racecraft.worlds.deepracer.training.plan import RaceRequest
from racecraft.worlds.deepracer.training.weight_transfer import CRITIC, fit_critic

TWO_ACTIONS = """{"action_space": [{"steering_angle": -20, "speed": 1, "index": 0},
 {"steering_angle": 20, "speed": 1, "index": 1}], "sensor": ["FRONT_FACING_CAMERA"], "neural_network":
 "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW", "action_space_type": "discrete", "version": "4"}"""


def trained(place, *overrides, said=None, **words):
    words = {"preset": "fast", **words}
    request = RaceRequest(run=place, stops=("iterations=1",), overrides=(*SMALL, *overrides), **words)
    return train(request, NullCallback(), said or (lambda text: None)).run


def first_weights(run):
    return Checkpoints(run.checkpoints).load_policy("0")[0]


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The run of a car that learned alone on the road."""
    return trained(tmp_path_factory.mktemp("cloning") / "alone")


@pytest.mark.parametrize("among", [("race.type=OBJECT_AVOIDANCE",), ("race.type=HEAD_TO_MODEL",)])
def test_a_car_that_drove_alone_goes_among_others_and_back(alone, tmp_path, among):
    learned, heard = Checkpoints(alone.checkpoints).load_policy("1")[0], []
    run = trained(tmp_path / "among", *among, clone_from=f"{alone.path}:1", said=heard.append)
    assert any("the critic was not told of objects" in line for line in heard)
    begun = first_weights(run)
    assert begun.keys() == learned.keys()
    for name in begun.keys() - {CRITIC}:
        np.testing.assert_array_equal(begun[name], learned[name], name)
    np.testing.assert_array_equal(begun[CRITIC][:, :-CRITIC_OBJECT_NUMBERS], learned[CRITIC])
    assert (begun[CRITIC][:, -CRITIC_OBJECT_NUMBERS:] == 0.0).all()
    back = first_weights(trained(tmp_path / "back", clone_from=f"{run.path}:0"))
    np.testing.assert_array_equal(back[CRITIC], learned[CRITIC])


def test_whoever_races_itself_meets_first_the_self_it_began_with(alone, tmp_path):
    run = trained(tmp_path / "self", "against.pool_every=9", against=("self",), clone_from=f"{alone.path}:1")
    head = "policy_head.weight"
    [first] = Checkpoints(run.checkpoints).load_state("1")["parts"]["opponents"]["selves"]
    np.testing.assert_array_equal(first[head], Checkpoints(alone.checkpoints).load_policy("1")[0][head])
    assert load_policy(run, "0").spec.observations["track_state"].shape == (first[CRITIC].shape[1],)


@pytest.mark.parametrize("against", [(), ("self",)], ids=["alone", "against itself"])
def test_a_clone_with_another_number_of_actions_is_refused_before_a_folder_is_made(alone, tmp_path, against):
    folder = tmp_path / "two"
    folder.mkdir()
    (folder / "model_metadata.json").write_text(TWO_ACTIONS)
    with pytest.raises(RunFolderError, match="was trained with a list of 10 actions, now there is a list of 2 actions"):
        trained(tmp_path / "run", folder=folder, against=against, clone_from=str(alone.path))
    assert not (tmp_path / "run").exists()


def test_only_a_critics_columns_for_objects_come_and_go():
    rng = np.random.default_rng(1)
    road = {CRITIC: rng.normal(size=(5, 17)), "value_head.bias": np.zeros(1)}
    for other in (np.zeros((5, 18)), np.zeros((6, 21))):
        weights, said = fit_critic(road, {CRITIC: other})
        assert (weights[CRITIC] == road[CRITIC]).all()
        assert said == ()
    assert fit_critic({"body": np.zeros(3)}, {CRITIC: np.zeros((5, 21))})[1] == ()


def test_weights_of_another_network_are_refused_with_the_words_that_fit(alone, tmp_path):
    other = ("network.separate_networks=true", "network.activation=relu")
    with pytest.raises(RunFolderError) as refused:
        trained(tmp_path / "other", *other, clone_from=f"{alone.path}:1", preset="aws")
    letter = str(refused.value)
    assert "separate_networks=false (here true)" in letter
    assert "Say --preset fast" in letter
    assert not (tmp_path / "other").exists()
    words = letter.split("Say --preset fast ")[1].split(",")[0]
    said = tuple(words.replace("--set ", "").split())
    begun = first_weights(trained(tmp_path / "same", *said, clone_from=f"{alone.path}:1"))
    assert begun.keys() == Checkpoints(alone.checkpoints).load_policy("1")[0].keys()


def test_weights_are_taken_however_those_of_today_would_begin(alone, tmp_path):
    begun = first_weights(trained(tmp_path / "r", "network.initialisation=glorot", clone_from=f"{alone.path}:1"))
    for name, values in Checkpoints(alone.checkpoints).load_policy("1")[0].items():
        np.testing.assert_array_equal(begun[name], values, name)


@pytest.mark.parametrize("has_metadata", [True, False])
def test_a_graph_of_ones_own_fast_car_clones_without_flags(alone, tmp_path, has_metadata):
    """The graph holds the policy; the critic begins anew. Without metadata beside it, the car's own is taken."""
    archive = export_to_car(alone.path, "1", tmp_path / "car.tar.gz").path
    shutil.unpack_archive(archive, tmp_path)
    graph = tmp_path / "agent" / "model.pb"
    if not has_metadata:
        (tmp_path / "model_metadata.json").unlink()
    begun = first_weights(trained(tmp_path / "clone", clone_from=str(graph)))
    learned = Checkpoints(alone.checkpoints).load_policy("1")[0]
    assert begun.keys() == learned.keys()
    for name in begun:
        if name.startswith("policy"):
            np.testing.assert_allclose(begun[name], learned[name], atol=1e-6, err_msg=name)

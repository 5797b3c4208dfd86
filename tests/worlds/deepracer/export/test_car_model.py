"""What goes to a car and to AWS's trainer: checked, and read back as the same policy."""

import json
import tarfile

import numpy as np
import pytest
import torch
from tests.worlds.deepracer.files.tensorflow.policies import METADATA, layers_for

from racecraft.algorithms.networks import Architecture
from racecraft.algorithms.plain_layers import NoPlainLayersError, layers_of
from racecraft.algorithms.policy_spec import PolicySpec, architecture_values
from racecraft.algorithms.q_network import QNetwork
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.world import ArraySpec, DiscreteActions
from racecraft.formats.checkpoint import Checkpoints
from racecraft.players.trained import load_policy
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.export import car_model
from racecraft.worlds.deepracer.export.agreement import ExportError, averages
from racecraft.worlds.deepracer.export.aws_folder import export_to_aws
from racecraft.worlds.deepracer.export.car_model import export_to_car
from racecraft.worlds.deepracer.export.refusal import export_refusal
from racecraft.worlds.deepracer.files.policy_graph import graph_of, read_policy_graph
from racecraft.worlds.deepracer.files.policy_weights import arrays_of
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import write_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, Node, write_graph
from racecraft.worlds.deepracer.players.aws_model import import_model

FRAMES = np.random.default_rng(2).integers(0, 256, (4, 120, 160)).astype(np.uint8)


def run_of(folder, kind, network):
    """A run made of drawn weights, as if it had been trained."""
    source = folder / f"{kind}-{network}"
    source.mkdir()
    layers, _ = layers_for(kind, network)
    if kind == "discrete" and network == "shallow":
        write_checkpoint(source / "4_Step-80.ckpt", arrays_of(layers))
    else:
        (source / "model.pb").write_bytes(write_graph(graph_of(layers)))
    METADATA[kind](source / "model_metadata.json")
    return import_model(source, folder / "run", track="Oval_track").run


@pytest.mark.parametrize(
    ("kind", "network", "shrink"), [("discrete", "small", 4), ("continuous", "tiny", 1), ("sac", "tiny", 1)]
)
def test_a_cars_archive_drives_as_its_checkpoint_does(tmp_path, kind, network, shrink):
    run = run_of(tmp_path, kind, network)

    done = export_to_car(run.path)

    assert done.agreement.frames == 192
    assert done.agreement.largest_difference < 1e-4
    assert (done.shrink, done.agreement.small_frames_share is None) == (shrink, shrink == 1)
    with tarfile.open(done.path) as archive:
        assert archive.getnames() == ["agent/model.pb", "model_metadata.json"]
        told = json.load(archive.extractfile("model_metadata.json"))
    assert set(told) >= {"action_space", "sensor", "neural_network", "version", "training_algorithm"}
    again = import_model(done.path, tmp_path / "again", track="Oval_track").run
    seen = {CAMERA_NAME: averages(FRAMES, shrink)}
    np.testing.assert_allclose(load_policy(again).act(seen), load_policy(run).act(seen), atol=1e-5)


@pytest.mark.parametrize(
    ("algorithm", "dueling", "trunk"), [("dqn", False, (5, 3)), ("apex", True, (5, 3)), ("dqn", True, ())]
)
def test_what_choices_are_worth_drives_a_car_as_likelihoods(tmp_path, algorithm, dueling, trunk):
    run = run_of(tmp_path, "discrete", "tiny")
    row = Architecture(((2, 24, 16), (3, 3, 2)), (4,), (), trunk)
    seen, actions = load_policy(run).spec.visible, load_policy(run).spec.actions
    network = QNetwork(seen, actions, row, dueling, torch.Generator().manual_seed(5))
    chance = torch.Generator().manual_seed(6)
    weights = {
        name: (one + 0.3 * torch.randn(one.shape, generator=chance)).numpy()
        for name, one in network.state_dict().items()
    }
    spec = PolicySpec(algorithm, seen, actions, {**architecture_values(row), "dueling": dueling})
    shelf = Checkpoints(run.checkpoints)
    card = {**shelf.load_policy("last")[1], "policy_spec": spec.as_dictionary()}
    shelf.save(9, 180, weights, card, score=9.0, best=True)
    worths = load_policy(run).policy.values({CAMERA_NAME: FRAMES})

    done = export_to_car(run.path)

    assert done.agreement.largest_difference < 1e-4
    again = import_model(done.path, tmp_path / "again", track="Oval_track").run
    likely = load_policy(again).probabilities({CAMERA_NAME: FRAMES})
    powers = np.exp(worths - worths.max(axis=1, keepdims=True))
    np.testing.assert_allclose(likely, powers / powers.sum(axis=1, keepdims=True), atol=1e-5)
    with pytest.raises(UserInputError, match="no critic of its own"):
        export_to_aws(run.path, "drfc", tmp_path / "drfc", check=False)


@pytest.mark.parametrize(("algorithm", "kind"), [("reinforce", "discrete"), ("es", "continuous"), ("bc", "discrete")])
def test_whoever_decides_by_ppos_network_goes_to_a_car_as_ppo_does(tmp_path, algorithm, kind):
    run = run_of(tmp_path, kind, "tiny")
    shelf = Checkpoints(run.checkpoints)
    weights, card = shelf.load_policy("last")
    card["policy_spec"]["algorithm"] = algorithm
    shelf.save(9, 180, weights, card, score=9.0, best=True)
    assert load_policy(run).spec.algorithm == algorithm
    assert export_to_car(run.path).agreement.largest_difference < 1e-4


def test_a_graph_that_acts_otherwise_is_not_written(tmp_path, monkeypatch):
    run = run_of(tmp_path, "discrete", "small")

    def upside_down(policy):
        """Another head's bias than the checkpoint's."""
        nodes = list(graph_of(policy).nodes.values())
        return Graph(
            Node(node.name, node.op, node.inputs, {**node.attributes, "value": node.attributes["value"][::-1].copy()})
            if node.name.endswith("policy_fc/bias")
            else node
            for node in nodes
        )

    monkeypatch.setattr(car_model, "graph_of", upside_down)
    with pytest.raises(ExportError, match="Nothing was written"):
        export_to_car(run.path, output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_aws_trainers_folder_comes_back_whole(tmp_path):
    """Best and last, policy and critic, by checkpoints whose .meta graph answers too."""
    run = run_of(tmp_path, "discrete", "shallow")

    done = export_to_aws(run.path, "drfc", tmp_path / "rl-deepracer-mine")

    assert done.checkpoints == ("4_Step-80.ckpt",)
    assert (done.path / "model" / ".coach_checkpoint").read_text() == "4_Step-80.ckpt"
    again = import_model(done.path, tmp_path / "again")
    assert not [note for note in again.notes if "anew" in note]
    with pytest.raises(SettingError, match="something stands there"):
        export_to_aws(run.path, "drfc", tmp_path / "rl-deepracer-mine")
    packed = export_to_aws(run.path, "console", tmp_path / "mine.tar.gz", check=False)
    from_console = import_model(packed.path, tmp_path / "third").run
    for one in (again.run, from_console):
        np.testing.assert_array_equal(
            load_policy(one).probabilities({CAMERA_NAME: FRAMES}), load_policy(run).probabilities({CAMERA_NAME: FRAMES})
        )


def test_one_checkpoint_that_is_named_goes_along_as_best_and_last(tmp_path):
    run = run_of(tmp_path, "discrete", "shallow")
    Checkpoints(run.checkpoints).save(6, 120, *Checkpoints(run.checkpoints).load_policy("4"), score=9.0, best=True)
    best = export_to_aws(run.path, "drfc", tmp_path / "both", check=False)
    older = export_to_aws(run.path, "drfc", tmp_path / "older", check=False, which="4")
    assert best.checkpoints == ("6_Step-120.ckpt",)
    assert older.checkpoints == ("4_Step-80.ckpt",)
    assert (older.path / "model" / ".coach_checkpoint").read_text() == "4_Step-80.ckpt"
    assert sorted(path.name for path in (older.path / "model").glob("*.pb")) == ["model_4.pb"]


@pytest.mark.parametrize(
    ("kind", "network", "words"), [("sac", "tiny", "learned by sac"), ("discrete", "small", "none of AWS's three")]
)
def test_what_awss_trainer_could_not_go_on_with_is_refused(tmp_path, kind, network, words):
    run = run_of(tmp_path, kind, network)
    with pytest.raises(UserInputError, match=words):
        export_to_aws(run.path, "drfc", tmp_path / "out", check=False)
    assert not (tmp_path / "out").exists()


SEEN = {CAMERA_NAME: ArraySpec((120, 160), np.uint8)}
NOT_PLAIN = {
    "another algorithm": (PolicySpec("mine:Own", SEEN, DiscreteActions(3)), "mine:Own"),
    "several frames": (PolicySpec("ppo", SEEN, DiscreteActions(3), stack_size=4), "stack_size=4"),
    "a memory": (PolicySpec("ppo", SEEN, DiscreteActions(3), {"memory": "lstm"}), "memory=lstm"),
    "its own network": (PolicySpec("ppo", SEEN, DiscreteActions(3), {"encoder": "my:Net"}), "encoder=my:Net"),
    "scaled vectors": (PolicySpec("ppo", SEEN, DiscreteActions(3), {"normalise": True}), "normalise=true"),
}


def test_a_page_learns_from_the_checkpoints_head_why_its_policy_cannot_be_exported(tmp_path):
    run = run_of(tmp_path, "discrete", "tiny")
    assert export_refusal(run) == ""
    shelf = Checkpoints(run.checkpoints)
    weights, card = shelf.load_policy("last")
    card["policy_spec"]["stack_size"] = 3
    shelf.save(9, 180, weights, card, score=9.0, best=True)
    with pytest.raises(NoPlainLayersError) as refused:
        layers_of(PolicySpec.from_dictionary(card["policy_spec"]), weights)
    assert export_refusal(run) == str(refused.value)
    assert "Train with --set network.stack_size=1." in str(refused.value)
    (run.checkpoints / shelf.find("best").policy).write_bytes(b"half a file")
    assert "cannot be read" in export_refusal(run)


@pytest.mark.parametrize("case", NOT_PLAIN)
def test_a_policy_that_no_car_knows_is_refused_by_the_setting_that_made_it(case):
    spec, words = NOT_PLAIN[case]
    with pytest.raises(NoPlainLayersError) as caught:
        layers_of(spec, {})
    assert words in str(caught.value)


def test_frames_that_do_not_divide_are_refused(tmp_path):
    spec = PolicySpec("ppo", {CAMERA_NAME: ArraySpec((50, 70), np.uint8)}, DiscreteActions(3), {"convolutions": []})
    layers = ("policy_head", "policy_body.trunk.0", "policy_body.trunk.2")
    weights = {f"{layer}.{part}": np.zeros((1, 1)) for layer in layers for part in ("weight", "bias")}
    with pytest.raises(NoPlainLayersError, match="sees 70 x 50 px; expected 160 x 120"):
        layers_of(spec, weights)


def test_a_graph_that_was_written_has_the_nodes_that_a_car_looks_up(tmp_path):
    layers, _ = layers_for("discrete", "shallow")
    (tmp_path / "model.pb").write_bytes(write_graph(graph_of(layers)))
    _, function = read_policy_graph(tmp_path / "model.pb")
    assert function.output == "main_level/agent/main/online/network_1/ppo_head_0/policy"
    assert function.inputs == {
        "main_level/agent/main/online/network_0/FRONT_FACING_CAMERA/FRONT_FACING_CAMERA": (-1, 120, 160, 1)
    }
    assert "main_level/agent/main/online/network_1/FRONT_FACING_CAMERA/Conv2d_4/Conv2D" in function.graph.nodes

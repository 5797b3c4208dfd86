"""Models of AWS's trainer from files to a car that drives: which files are taken, what is said, what is refused."""

import json
import shutil
import tarfile
from pathlib import Path

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.policies import METADATA, layers_for, write_listed

from racecraft.contract.errors import MetadataError, RunFolderError, TrackError, UserInputError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.players.open_run import open_run
from racecraft.players.trained import load_policy
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.files.policy_graph import graph_of
from racecraft.worlds.deepracer.files.policy_weights import arrays_of
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import write_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, GraphError, Node, write_graph, write_meta_graph
from racecraft.worlds.deepracer.files.trained_model import ForeignModelError
from racecraft.worlds.deepracer.players.aws_model import import_model
from racecraft.worlds.deepracer.players.open_run import is_aws_model
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.training.plan import plan_resume

FRAMES = np.random.default_rng(2).integers(0, 256, (4, 120, 160)).astype(np.uint8)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A model folder as DeepRacer for Cloud leaves it, and what its best checkpoint thinks of FRAMES."""
    folder = tmp_path_factory.mktemp("bucket") / "rl-deepracer-sagemaker"
    for name in ("model", "ip"):
        (folder / name).mkdir(parents=True)
    layers, policy = layers_for("discrete", "tiny")  # none of AWS's: its strides are told by the .meta file alone
    for name in ("7_Step-900.ckpt", "9_Step-1200.ckpt"):
        write_checkpoint(folder / "model" / name, arrays_of(layers))
        (folder / "model" / f"{name}.meta").write_bytes(write_meta_graph(graph_of(layers)))
    (folder / "model" / "model_9.pb").write_bytes(write_graph(graph_of(layers)))
    write_listed(folder / "model" / "model_metadata.json")
    marks = {
        "best_checkpoint": {"name": "7_Step-900.ckpt", "avg_eval_metric": 88.5, "time_stamp": 1.0},
        "last_checkpoint": {"name": "9_Step-1200.ckpt", "avg_eval_metric": 60.0, "time_stamp": 2.0},
    }
    (folder / "model" / "deepracer_checkpoints.json").write_text(json.dumps(marks))
    (folder / "ip" / "hyperparameters.json").write_text('{"lr": 0.0002}')
    (folder / "reward_function.py").write_text("def reward_function(params):\n    return 1.0\n")
    (folder / "training_params.yaml").write_text("---\nWORLD_NAME: 'Oval_track'\n")
    return folder, policy.probabilities({CAMERA_NAME: FRAMES})


def test_a_model_folder_becomes_a_run_with_all_its_checkpoints(model, tmp_path):
    folder, likely = model

    done = import_model(folder, tmp_path / "run")

    assert (done.checkpoints, done.best) == ((7, 9), 7)
    assert not [note for note in done.notes if "anew" in note]
    best = Checkpoints(done.run.checkpoints).find("best")
    assert (best.iteration, best.steps, best.score) == (7, 900, 88.5)
    np.testing.assert_allclose(load_policy(done.run).probabilities({CAMERA_NAME: FRAMES}), likely, atol=1e-5)
    car = load_trained_car(done.run.path)
    assert car.trained_on.name == "Oval_track"
    assert (car.settings.camera.width, car.settings.race.car) == (160, "v5-classic")
    assert "lr" in done.run.hyperparameters.read_text()
    assert done.run.reward_function.is_file()


def test_it_is_not_resumed_for_nothing_of_its_trainer_is_there(model, tmp_path):
    run = import_model(model[0], tmp_path / "run").run
    with pytest.raises(RunFolderError, match=r"was imported from rl-deepracer-sagemaker.*--from"):
        plan_resume(run.path)


@pytest.mark.parametrize("form", ["folder", "graph", "checkpoint", "archive"])
def test_a_policy_is_loaded_from_any_form_of_it(model, tmp_path, form):
    folder, likely = model
    sources = {
        "folder": folder,
        "graph": folder / "model" / "model_9.pb",
        "checkpoint": folder / "model" / "9_Step-1200.ckpt",
        "archive": tmp_path / "model.tar.gz",
    }
    with tarfile.open(sources["archive"], "w:gz", compresslevel=1) as archive:
        archive.add(folder, "my-model")
    assert is_aws_model(sources[form])
    np.testing.assert_allclose(load_policy(sources[form]).probabilities({CAMERA_NAME: FRAMES}), likely, atol=1e-5)


def test_a_run_of_ours_is_opened_as_it_is(model, tmp_path):
    run = import_model(model[0], tmp_path / "run").run
    assert open_run(run.path).path == run.path
    assert not is_aws_model(tmp_path)


def test_a_graph_that_computes_more_than_its_layers_tell_is_refused(tmp_path):
    """Somebody put a tanh between two layers that have AWS's names."""
    layers, _ = layers_for("discrete", "tiny")
    nodes = list(graph_of(layers).nodes.values())
    head = next(number for number, node in enumerate(nodes) if node.name.endswith("policy_fc/MatMul"))
    bent = Node("bent", "Tanh", (nodes[head].inputs[0],), {})
    nodes[head] = Node(nodes[head].name, "MatMul", ("bent", nodes[head].inputs[1]), nodes[head].attributes)
    nodes.insert(head, bent)
    (tmp_path / "model.pb").write_bytes(write_graph(Graph(nodes)))
    write_listed(tmp_path / "model_metadata.json")
    with pytest.raises(ForeignModelError, match="answers otherwise than its layers"):
        import_model(tmp_path, tmp_path / "run")


def _alone(folder, network="tiny"):
    folder.mkdir(exist_ok=True)
    (folder / "model.pb").write_bytes(write_graph(graph_of(layers_for("discrete", network)[0])))
    return folder


BAD = {
    "nothing there": (lambda folder: folder / "gone.pb", ForeignModelError, "there is no such file"),
    "no weights": (lambda folder: write_listed(folder / "model_metadata.json") or folder, ForeignModelError,
                   "holds no weights"),
    "no metadata": (lambda folder: _alone(folder), ForeignModelError, "--metadata FILE"),
    "metadata of more actions": (
        lambda folder: write_listed(_alone(folder) / "model_metadata.json", 7) or folder, ForeignModelError,
        "chooses among 5 (discrete); expected 7 actions",
    ),
    "metadata of two ranges": (
        lambda folder: METADATA["continuous"](_alone(folder) / "model_metadata.json") or folder, ForeignModelError,
        "chooses among 5 (discrete); expected 2 numbers",
    ),
    "metadata that is none": (
        lambda folder: (_alone(folder) / "model_metadata.json").write_text("{") and folder, MetadataError, "JSON"
    ),
    "a graph that is none": (
        lambda folder: (_alone(folder) / "model.pb").write_bytes(b"graph")
        and (write_listed(folder / "model_metadata.json") or folder),
        GraphError, "damaged, or no graph",
    ),
    "marks that are none": (
        lambda folder: (_alone(folder) / "deepracer_checkpoints.json").write_text("[]")
        and (write_listed(folder / "model_metadata.json") or folder),
        UserInputError, "deepracer_checkpoints.json",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_model_is_refused_by_a_letter_and_no_run_is_left(tmp_path, case):
    make, error, words = BAD[case]
    folder = tmp_path / "model"
    folder.mkdir()
    with pytest.raises(error) as caught:
        import_model(make(folder), tmp_path / "run")
    assert words in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_a_track_that_is_not_known_is_said_and_one_that_is_asked_for_must_be(model, tmp_path):
    folder = tmp_path / "model"
    shutil.copytree(model[0], folder)
    (folder / "training_params.yaml").write_text("---\nWORLD_NAME: 'My_own_track'\n")
    assert any("'My_own_track' is not known" in note for note in import_model(folder, tmp_path / "a").notes)
    with pytest.raises(TrackError):
        import_model(folder, tmp_path / "b", track="My_own_track")


def test_metadata_may_be_named(tmp_path):
    write_listed(tmp_path / "car.json")
    done = import_model(_alone(tmp_path / "x") / "model.pb", tmp_path / "run", metadata=tmp_path / "car.json")
    assert any("the critic begins anew" in note for note in done.notes)
    assert Path(done.run.model_metadata).is_file()

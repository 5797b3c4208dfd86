"""Models that see by more than the front camera: read, joined in AWS's order, written under the names cars look up."""

import json
import tarfile
from dataclasses import replace

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.policies import METADATA, layers_for, moments, write_listed

from racecraft.formats.policy_layers import PolicyLayersError
from racecraft.players.trained import load_policy
from racecraft.worlds.deepracer.export.aws_folder import export_to_aws
from racecraft.worlds.deepracer.export.car_model import export_to_car
from racecraft.worlds.deepracer.files.policy_graph import graph_of
from racecraft.worlds.deepracer.files.policy_layers import require_aws_network
from racecraft.worlds.deepracer.files.policy_weights import arrays_of
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import write_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, graph_in, write_graph, write_meta_graph
from racecraft.worlds.deepracer.files.trained_model import ForeignModelError
from racecraft.worlds.deepracer.players.aws_model import import_model
from racecraft.worlds.deepracer.players.trained_car import load_trained_car

FRONT, LEFT, STEREO, OLD = "FRONT_FACING_CAMERA", "LEFT_CAMERA", "STEREO_CAMERAS", "observation"
LIDAR, SECTORS, STEPS = "LIDAR", "SECTOR_LIDAR", "DISCRETIZED_SECTOR_LIDAR"
CARS = [
    (LEFT,), (STEREO,), (OLD,), (FRONT, LIDAR), (FRONT, SECTORS), (FRONT, STEPS), (LEFT, LIDAR), (STEREO, LIDAR),
    (STEREO, SECTORS), (STEREO, STEPS), (LIDAR, OLD),
]  # fmt: skip
SHAPES = {STEREO: (-1, 120, 160, 2), LIDAR: (-1, 64), SECTORS: (-1, 8), STEPS: (-1, 64)}
INPUTS = {"discrete": "main", "continuous": "main", "sac": "policy"}


def written(folder, kind, sensors, form, network="tiny"):
    """Write a model of drawn weights, and return its folder and the policy that it is."""
    layers, policy = layers_for(kind, network, sensors)
    folder.mkdir()
    METADATA[kind](folder / "model_metadata.json", sensors=sensors)
    if form == "graph":
        (folder / "model.pb").write_bytes(write_graph(graph_of(layers)))
    else:
        write_checkpoint(folder / "3_Step-9.ckpt", arrays_of(layers))
        (folder / "3_Step-9.ckpt.meta").write_bytes(write_meta_graph(graph_of(layers)))
    return folder, policy


@pytest.mark.parametrize("kind", ["discrete", "sac"])
@pytest.mark.parametrize("sensors", CARS, ids="+".join)
def test_a_graph_asks_for_each_sensor_by_the_name_that_a_car_looks_up(kind, sensors):
    layers, _ = layers_for(kind, "tiny", sensors)
    graph = graph_in(write_graph(graph_of(layers)), "model.pb")
    asked = {node.name: node.attributes["shape"].sizes for node in graph.nodes.values() if node.op == "Placeholder"}
    scope = f"main_level/agent/{INPUTS[kind]}/online/network_0"
    assert asked == {f"{scope}/{one}/{one}": SHAPES.get(one, (-1, 120, 160, 1)) for one in sensors}
    if len(sensors) > 1:
        joined = next(node for node in graph.nodes.values() if node.op == "ConcatV2")
        assert joined.name.endswith("/merger")
        assert [name.split("/")[-2] for name in joined.inputs[:-1]] == sorted(sensors)


@pytest.mark.parametrize("form", ["graph", "checkpoint"])
@pytest.mark.parametrize(("kind", "sensors"), [
    ("discrete", (STEREO, SECTORS)), ("continuous", (FRONT, LIDAR)), ("sac", (LIDAR, OLD)), ("continuous", (LEFT,)),
])  # fmt: skip
def test_what_sees_by_several_sensors_drives_here_as_it_did(tmp_path, kind, sensors, form):
    """Our network, made by torch, answers as the one whose weights went through AWS's names."""
    source, policy = written(tmp_path / "model", kind, sensors, form)

    done = import_model(source, tmp_path / "run", track="Oval_track")

    again, seen = load_policy(done.run), moments(sensors)
    assert sorted(again.spec.visible) == sorted(seen)
    np.testing.assert_allclose(again.act(seen), policy.act(seen), atol=1e-5)
    if kind == "discrete":
        np.testing.assert_allclose(again.probabilities(seen), policy.probabilities(seen), atol=1e-6)
    groups = load_trained_car(done.run.path).policy.metadata["settings"]["network"]
    assert (groups["vector_units"], groups["hidden_units"][:1]) == ([5, 3] if len(sensors) > 1 else None, [6])


@pytest.mark.parametrize(("kind", "sensors", "network", "shrink"), [
    ("discrete", (STEREO, SECTORS), "small", 4), ("continuous", (STEREO,), "tiny", 1),
    ("sac", (FRONT, LIDAR), "bare", 1),
])  # fmt: skip
def test_the_archive_of_a_car_of_several_sensors_drives_as_its_checkpoint(tmp_path, kind, sensors, network, shrink):
    """`bare` and `small` let the LiDAR's numbers meet the camera's without a layer of their own."""
    source, _ = written(tmp_path / "model", kind, tuple(reversed(sensors)), "graph", network)
    run = import_model(source, tmp_path / "run", track="Oval_track").run

    done = export_to_car(run.path)

    assert done.agreement.largest_difference < 1e-4
    assert (done.shrink, done.agreement.small_frames_share is None) == (shrink, shrink == 1)
    with tarfile.open(done.path) as archive:
        assert json.load(archive.extractfile("model_metadata.json"))["sensor"] == sorted(sensors)
    again, policy = import_model(done.path, tmp_path / "again", track="Oval_track").run, load_policy(run)
    seen = moments(sensors, network)
    np.testing.assert_allclose(load_policy(again).act(seen), policy.act(seen), atol=1e-5)


def test_a_sensor_that_no_physical_car_has_is_said(tmp_path):
    source, _ = written(tmp_path / "model", "discrete", (FRONT, STEPS), "graph")
    run = import_model(source, tmp_path / "run", track="Oval_track").run
    assert any(STEPS in note for note in export_to_car(run.path, check=False).notes)


@pytest.mark.long
def test_awss_trainer_gets_every_sensor_of_its_network(tmp_path):
    source, policy = written(tmp_path / "model", "discrete", (STEREO, LIDAR), "checkpoint", "shallow")
    run = import_model(source, tmp_path / "run", track="Oval_track").run

    folder = export_to_aws(run.path, "drfc", tmp_path / "rl-deepracer-mine", check=False).path

    again, seen = load_policy(import_model(folder, tmp_path / "again").run), moments((STEREO, LIDAR))
    np.testing.assert_allclose(again.probabilities(seen), policy.probabilities(seen), atol=1e-6)


def test_awss_trainer_goes_on_with_its_own_layers_over_a_lidar_only():
    layers, _ = layers_for("discrete", "shallow", (FRONT, SECTORS))
    require_aws_network(layers)
    lidar = replace(layers.network.sensors[1], dense=layers.network.sensors[1].dense[:1])
    other = replace(layers, network=replace(layers.network, sensors=(layers.network.sensors[0], lidar)))
    with pytest.raises(PolicyLayersError, match=f"network for {SECTORS} is none of AWS's"):
        require_aws_network(other)


@pytest.mark.parametrize(("there", "told"), [
    ((FRONT,), (STEREO,)), ((FRONT, LIDAR), (FRONT,)), ((FRONT, LIDAR), (FRONT, STEPS)), ((OLD, LIDAR), (FRONT, LIDAR)),
])  # fmt: skip
def test_metadata_of_another_car_is_refused(tmp_path, there, told):
    source, _ = written(tmp_path / "model", "discrete", there, "graph")
    write_listed(source / "model_metadata.json", sensors=told)
    with pytest.raises(Exception, match="sees by") as caught:
        import_model(source, tmp_path / "run")
    assert "the metadata that it was trained with" in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_cameras_of_one_eye_are_the_same_by_any_name(tmp_path):
    source, policy = written(tmp_path / "model", "discrete", (OLD,), "graph")
    write_listed(source / "model_metadata.json", sensors=(LEFT,))
    seen = moments()
    again = load_policy(import_model(source, tmp_path / "run").run)
    np.testing.assert_allclose(again.probabilities(seen), policy.probabilities(seen), atol=1e-6)


def test_a_graph_that_joins_its_sensors_in_another_order_is_refused(tmp_path):
    """Its weights fit all the same, and would be read by the wrong numbers."""
    source, _ = written(tmp_path / "model", "discrete", (FRONT, LIDAR), "graph")
    nodes = graph_in((source / "model.pb").read_bytes(), "model.pb").nodes
    place, joined = next((name, node) for name, node in nodes.items() if node.op == "ConcatV2")
    nodes[place] = replace(joined, inputs=(*reversed(joined.inputs[:-1]), joined.inputs[-1]))
    (source / "model.pb").write_bytes(write_graph(Graph(nodes.values())))
    with pytest.raises(ForeignModelError, match="answers otherwise than its layers"):
        import_model(source, tmp_path / "run")

"""Policies for other runtimes: what ONNX, OpenVINO and TensorFlow Lite compute from our files is what the policy says.

OpenVINO and TensorFlow are asked where they are installed: in an environment of their own, with racecraft beside them.
"""

import sys
import warnings

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.policies import METADATA, RANGES, layers_for, moments

from racecraft.contract.errors import MissingExtraError, SettingError
from racecraft.worlds.deepracer.export import policy_file
from racecraft.worlds.deepracer.export.agreement import ExportError, as_fed, averages
from racecraft.worlds.deepracer.export.policy_file import FORMATS, export_policy
from racecraft.worlds.deepracer.files.policy_graph import graph_of, input_name, output_name
from racecraft.worlds.deepracer.files.tensorflow.graph import write_graph
from racecraft.worlds.deepracer.players.aws_model import import_model

FRONT, STEREO, LIDAR, SECTORS, OLD = "FRONT_FACING_CAMERA", "STEREO_CAMERAS", "LIDAR", "SECTOR_LIDAR", "observation"
PACKAGES = {"onnx": "onnxruntime", "openvino": "openvino", "tflite": "tensorflow"}
POLICIES = [
    ("discrete", (FRONT,), "tiny"), ("continuous", (STEREO,), "tiny"), ("sac", (FRONT, LIDAR), "tiny"),
    ("discrete", (STEREO, SECTORS), "small"), ("continuous", (LIDAR, OLD), "bare"), ("sac", (FRONT,), "small"),
]  # fmt: skip


def guest(package):
    """Import an optional package, or skip; what it warns about itself is no affair of these tests."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(package)


def seen_by(sensors, network):
    """Return the same moments as a file is fed and as the policy sees them."""
    whole = moments(sensors)
    shrink = 4 if network == "small" else 1
    small = {name: averages(one, shrink) if shrink > 1 and one.ndim > 2 else one for name, one in whole.items()}
    pairs = zip(sorted(whole), sorted(sensors), strict=True)
    fed = {theirs: as_fed(whole[ours], whole[ours].ndim > 2) for ours, theirs in pairs}
    return fed, small


def commands_of(kind, policy, seen):
    if kind == "discrete":
        return policy.probabilities(seen)
    low, high = (np.array(getattr(RANGES, end), np.float32) for end in ("low", "high"))
    return 2 * (policy.act(seen) - low) / (high - low) - 1


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("to", FORMATS)
@pytest.mark.parametrize(("kind", "sensors", "network"), POLICIES)
def test_another_runtime_answers_from_our_file_as_the_policy_does(to, kind, sensors, network):
    guest(PACKAGES[to])
    layers, policy = layers_for(kind, network, sensors)
    fed, seen = seen_by(sensors, network)

    told = FORMATS[to].answer(layers, FORMATS[to].files(layers, "{}"))(fed)

    np.testing.assert_allclose(told, commands_of(kind, policy, seen), atol=2e-5)


def test_an_onnx_file_says_by_itself_what_goes_in_and_what_comes_out():
    onnx = guest("onnx")
    layers, _ = layers_for("discrete", "tiny", (STEREO, LIDAR))
    model = onnx.load_from_string(FORMATS["onnx"].files(layers, '{"sensor": []}')[".onnx"])
    shapes = {
        one.name: [part.dim_param or part.dim_value for part in one.type.tensor_type.shape.dim]
        for one in (*model.graph.input, *model.graph.output)
    }
    assert shapes == {LIDAR: ["batch", 64], STEREO: ["batch", 120, 160, 2], "policy": ["batch", 5]}
    assert {one.key: one.value for one in model.metadata_props} == {"model_metadata": '{"sensor": []}'}


@pytest.fixture
def run(tmp_path):
    (tmp_path / "model").mkdir()
    layers, _ = layers_for("discrete", "small", (STEREO, SECTORS))
    (tmp_path / "model" / "model.pb").write_bytes(write_graph(graph_of(layers)))
    METADATA["discrete"](tmp_path / "model" / "model_metadata.json", sensors=(STEREO, SECTORS))
    return import_model(tmp_path / "model", tmp_path / "run", track="Oval_track").run.path


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("to", FORMATS)
def test_a_run_is_written_when_every_action_agrees(run, tmp_path, to):
    guest(PACKAGES[to])

    done = export_policy(run, to, output=tmp_path / "out" / f"mine{FORMATS[to].end}")

    assert (done.agreement.frames, done.shrink) == (192, 4)
    assert done.agreement.largest_difference < 1e-4
    assert done.paths[0] == tmp_path / "out" / f"mine{FORMATS[to].end}"
    assert all(path.stat().st_size > 0 for path in done.paths)
    assert len(done.paths) == (2 if to == "openvino" else 1)


def test_a_file_that_acts_otherwise_is_not_written(run, tmp_path, monkeypatch):
    guest("onnxruntime")
    honest = FORMATS["onnx"]
    crooked = policy_file.PolicyFormat(
        ".onnx", honest.files, lambda policy, files: lambda seen: np.roll(honest.answer(policy, files)(seen), 1, axis=1)
    )
    monkeypatch.setattr(policy_file, "FORMATS", {"onnx": crooked})
    with pytest.raises(ExportError, match="Nothing was written"):
        export_policy(run, "onnx", output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("to", "package"), [
    ("onnx", "onnxruntime"), ("openvino", "openvino"), ("tflite", "tensorflow"),
])  # fmt: skip
def test_a_missing_package_is_named_with_the_command_that_installs_it(run, tmp_path, monkeypatch, to, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtraError, match=rf"pip install 'racecraft\[{to}\]'"):
        export_policy(run, to, output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_file_of_another_end_is_refused(run, tmp_path):
    with pytest.raises(SettingError, match=r"ends in \.xml"):
        export_policy(run, "openvino", output=tmp_path / "mine.onnx")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("kind", "sensors"), [("discrete", (FRONT,)), ("discrete", (STEREO, SECTORS)),
                                               ("continuous", (FRONT, LIDAR))])  # fmt: skip
def test_a_cars_own_converter_to_openvino_finds_its_inputs(tmp_path, kind, sensors):
    """It lays the sensors of the metadata beside the inputs that OpenVINO finds, one by one, and halves the numbers."""
    openvino = guest("openvino")
    layers, policy = layers_for(kind, "tiny", sensors)
    (tmp_path / "model.pb").write_bytes(write_graph(graph_of(layers)))
    shapes = [[1, *sensor.shape] for sensor in sorted(layers.network.sensors, key=lambda one: one.name)]

    found = openvino.convert_model(tmp_path / "model.pb")
    names = [place.get_any_name() for place in found.inputs]
    output = next(place.get_any_name() for place in found.outputs)
    model = openvino.convert_model(tmp_path / "model.pb", input=list(zip(names, shapes, strict=True)), output=output)
    openvino.save_model(model, tmp_path / "model.xml", compress_to_fp16=True)

    assert output.startswith(output_name(kind))
    assert names == [f"{input_name(kind, sensor)}:0" for sensor in sorted(sensors)]
    compiled = openvino.compile_model(tmp_path / "model.xml", "CPU", {"INFERENCE_PRECISION_HINT": "f32"})
    fed, seen = seen_by(sensors, "tiny")
    rows = [compiled([fed[name][row : row + 1] for name in sorted(fed)])[0] for row in range(4)]
    told = np.concatenate(rows) if kind == "discrete" else np.clip(np.concatenate(rows), -1, 1)
    np.testing.assert_allclose(told, commands_of(kind, policy, seen), atol=5e-3)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("sensors", [(FRONT,), (STEREO, SECTORS)])
def test_a_cars_own_converter_to_tensorflow_lite_takes_the_graph_by_its_names(tmp_path, sensors):
    tensorflow = guest("tensorflow")
    layers, policy = layers_for("discrete", "tiny", sensors)
    (tmp_path / "model.pb").write_bytes(write_graph(graph_of(layers)))
    shapes = {input_name("discrete", one.name): [1, *one.shape] for one in layers.network.sensors}

    converter = tensorflow.compat.v1.lite.TFLiteConverter.from_frozen_graph(
        str(tmp_path / "model.pb"), input_arrays=list(shapes), input_shapes=shapes,
        output_arrays=[output_name("discrete")],
    )  # fmt: skip
    converter.optimizations = [tensorflow.lite.Optimize.DEFAULT]
    converter.target_spec.supported_types = [tensorflow.float16]
    content = converter.convert()

    fed, seen = seen_by(sensors, "tiny")
    told = FORMATS["tflite"].answer(layers, {".tflite": content})(fed)
    np.testing.assert_allclose(told, policy.probabilities(seen), atol=5e-3)

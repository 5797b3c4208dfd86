"""Models that cannot be taken in and policies that cannot be handed over: exit code 2, a letter, nothing left."""

import io
import json
import os
import sys
import tarfile
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from tests.cli.conftest import TINY
from tests.worlds.deepracer.files.tensorflow.policies import layers_for, write_listed

from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.files.policy_graph import graph_of
from racecraft.worlds.deepracer.files.policy_weights import arrays_of
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import write_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, Node, write_graph

FRONT, STEREO = "FRONT_FACING_CAMERA", "STEREO_CAMERAS"
HEAD = "main_level/agent/main/online/network_1/ppo_head_0"
LAST = f"{HEAD}/policy"


def frozen(change=lambda node: node, sensors=(FRONT,)):
    """Return a frozen graph, each node of it changed; None takes a node away."""
    nodes = graph_of(layers_for("discrete", "tiny", sensors)[0]).nodes.values()
    return write_graph(Graph(node for node in map(change, nodes) if node is not None))


def model(folder, content=None, sensors=(FRONT,), told=None, count=5):
    """Write a folder with a graph and its metadata."""
    folder.mkdir(exist_ok=True)
    (folder / "model.pb").write_bytes(frozen(sensors=sensors) if content is None else content)
    write_listed(folder / "model_metadata.json", count, told or sensors)
    return folder


def only(part, **told):
    """Return a change of the nodes whose names hold a part."""
    return lambda node: replace(node, **told) if part in node.name else node


def without(end):
    return lambda node: None if node.name.endswith(end) else node


def checkpoint(folder, spoil=lambda path: None):
    folder.mkdir()
    write_checkpoint(folder / "3_Step-9.ckpt", arrays_of(layers_for("discrete", "shallow")[0]))
    write_listed(folder / "model_metadata.json")
    spoil(folder)
    return folder


def flip(folder):
    path = folder / "3_Step-9.ckpt.data-00000-of-00001"
    content = bytearray(path.read_bytes())
    content[1000] ^= 1
    path.write_bytes(content)


def archive(path, members):
    with tarfile.open(path, "w:gz") as packed:
        for name, content in members.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            packed.addfile(entry, io.BytesIO(content))
    return path


def zipped(path, members):
    with zipfile.ZipFile(path, "w") as packed:
        for name, content in members.items():
            packed.writestr(name, content)
    return path


def cut(path, content):
    path.write_bytes(content[: len(content) // 2])
    return path


def whole_archive(folder):
    source = model(folder / "whole")
    return archive(folder / "whole.tar.gz", {"agent/model.pb": (source / "model.pb").read_bytes()}).read_bytes()


def nan_head(node):
    if not node.name.endswith("policy_fc/bias"):
        return node
    return replace(node, attributes={**node.attributes, "value": np.full(5, np.nan, np.float32)})


IMPORTS = {
    # What the letter must hold, and what is imported, laid out in an empty folder.
    "nothing there": (["there is no such file or folder"], lambda t: t / "gone.tar.gz"),
    "a text": (["its name is no graph's"], lambda t: (t / "notes.txt").write_text("x") and t / "notes.txt"),
    "a lone graph without metadata": (
        ["no model_metadata.json lies beside it", "--metadata FILE"],
        lambda t: (t / "lone.pb").write_bytes(frozen()) and t / "lone.pb",
    ),
    "a page of a browser in place of a graph": (["a web page (HTML)"], lambda t: model(t / "m", b"<html></html>")),
    "half a graph": (["model.pb"], lambda t: model(t / "m", frozen()[: len(frozen()) // 2])),
    "a graph that is not frozen": (
        ["holds no weights", "is a variable", "Give the checkpoint"],
        lambda t: model(t / "m", frozen(lambda node: replace(node, op="VariableV2") if node.op == "Const" else node)),
    ),
    "a graph with a foreign operation": (
        ["m/model.pb: main_level", "the operation Erf is not known here", "convolutions and dense layers"],
        lambda t: model(t / "m", frozen(lambda node: replace(node, op="Erf") if node.op == "Relu" else node)),
    ),
    "a graph of another program": (
        ["no policy of a DeepRacer car", "ppo_head_0/policy_fc/kernel"],
        lambda t: model(t / "m", write_graph(Graph([Node("a/kernel", "Const", (), {"value": np.ones((2, 2), "f4")})]))),
    ),
    "a graph that reads a node it does not hold": (
        ["Flatten/flatten/Reshape/shape", "the graph holds no such node"],
        lambda t: model(t / "m", frozen(without("Reshape/shape"))),
    ),
    "a graph that reads itself": (
        ["reads itself in a circle"],
        lambda t: model(t / "m", frozen(only("policy_fc/MatMul", inputs=(LAST, f"{HEAD}/policy_fc/kernel/read")))),
    ),
    "weights that are no numbers": (["no finite numbers"], lambda t: model(t / "m", frozen(nan_head))),
    "metadata of more actions": (["chooses among 5", "7 actions"], lambda t: model(t / "m", count=7)),
    "metadata of another camera": (
        ["its network sees by FRONT_FACING_CAMERA, its car by STEREO_CAMERAS"],
        lambda t: model(t / "m", told=(STEREO,)),
    ),
    "a checkpoint with a flipped bit": (["checksum"], lambda t: checkpoint(t / "m", flip)),
    "a checkpoint cut short": (
        ["00000-of-00001: ends before", "Copy it again"],
        lambda t: checkpoint(t / "m", lambda folder: os.truncate(folder / "3_Step-9.ckpt.data-00000-of-00001", 100)),
    ),
    "half an archive": (["damaged"], lambda t: cut(t / "half.tar.gz", whole_archive(t))),
    "an archive that leads out of itself": (
        ["'../model.pb' leads out of the archive"], lambda t: archive(t / "a.tar.gz", {"../model.pb": b"x"})
    ),
    "an archive of pictures": (["holds no file of a model"], lambda t: zipped(t / "a.zip", {"me.png": b"x"})),
}  # fmt: skip


@pytest.mark.parametrize("name", IMPORTS)
def test_what_is_no_model_is_named_and_leaves_no_run(name, racecraft, tmp_path):
    wanted, lay = IMPORTS[name]
    said = racecraft("import", lay(tmp_path), "run")
    assert said.code == 2, said.err
    assert "Traceback" not in said.err
    for part in wanted:
        assert part in " ".join(said.err.split()), said.err
    assert not (tmp_path / "run").exists()


def imported(racecraft, folder):
    assert racecraft("import", model(folder / "m"), "r", "--track", "Oval_track").code == 0


EXPORTS = {
    "an unknown format": (["--to 'onxx'", "Did you mean 'onnx'?"], ["--to", "onxx"]),
    "a file of another end": (["ends in .onnx"], ["--to", "onnx", "--output", "mine.pb"]),
    "a lone graph for AWS's trainer": (["none of AWS's three"], ["--to", "drfc"]),
    "a car for Unity": (["one of `racecraft train`; expected one of Unity", "--to car or drfc"], ["--to", "unity"]),
}


@pytest.mark.parametrize("name", EXPORTS)
def test_what_cannot_be_handed_over_is_said(name, racecraft, tmp_path):
    wanted, words = EXPORTS[name]
    imported(racecraft, tmp_path)
    said = racecraft("export", *([] if words[0] == "gone" else ["r"]), *words)
    assert said.code == 2, said.err
    assert "Traceback" not in said.err
    for part in wanted:
        assert part in " ".join(said.err.split()), said.err
    assert not (tmp_path / "r" / "export").exists()


@pytest.mark.parametrize(("to", "package"), [("onnx", "onnx"), ("tflite", "tensorflow")])
def test_a_missing_extra_is_named_with_its_command(racecraft, tmp_path, monkeypatch, to, package):
    imported(racecraft, tmp_path)
    monkeypatch.setitem(sys.modules, package, None)
    said = racecraft("export", "r", "--to", to)
    assert (said.code, f"pip install 'racecraft[{to}]'" in said.err) == (2, True)
    assert not (tmp_path / "r" / "export").exists()


@pytest.mark.parametrize("to", ["car", "onnx", "drfc"])
def test_a_run_of_another_world_is_no_car(racecraft, tmp_path, to):
    RunFolder.create(tmp_path / "snake", {"kind": "battlesnake", "title": "a snake"})
    said = racecraft("export", "snake", "--to", to)
    assert said.code == 2
    assert "one of `racecraft snakes train`" in said.err
    assert "racecraft snakes serve RUN" in said.err, "and what can be done with it"


def test_a_policy_with_a_memory_is_refused_by_the_setting_that_made_it(racecraft, tmp_path):
    words = ["--set", "network.memory=lstm", "--stop", "iterations=1", "--no-pictures"]
    assert racecraft("train", "--run", "r", *words, *TINY).code == 0
    for to in ("car", "onnx"):
        said = racecraft("export", "r", "--to", to)
        assert said.code == 2
        assert "network.memory=lstm" in said.err
        assert "Train without it" in said.err


def test_what_the_command_prints(racecraft, tmp_path):
    pytest.importorskip("onnxruntime")
    imported(racecraft, tmp_path)
    done = racecraft("export", "r", "--to", "onnx", "--output", "mine.onnx", "--json")
    told = json.loads(done.out)
    assert (told["files"], told["checked_on"], told["pixels_averaged"]) == (["mine.onnx"], 192, 1)
    said = racecraft("export", "r", "--to", "onnx")
    assert "every action agrees" in said.out

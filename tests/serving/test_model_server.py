"""A model that functions of its own file serve, in a process that can read the model and compute."""

import asyncio
import io
import json
import time

import numpy as np
import pytest
from tests.serving.test_endpoint_server import VECTOR, policy_for

from racecraft.contract.errors import SettingError
from racecraft.contract.world import DiscreteActions
from racecraft.isolation.layers import can_isolate
from racecraft.serving import model_functions, model_process
from racecraft.serving.model_functions import ModelFunctionError, ModelFunctions
from racecraft.serving.model_process import ModelLoadError
from racecraft.serving.model_server import ModelServer
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest

isolated = pytest.mark.skipif(not can_isolate(), reason="this system isolates no code")

FOUR = """
import json, os, socket, time
from beside import FACTOR

def model_fn(model_dir):
    print("loaded")
    with open(os.path.join(model_dir, "weights.json")) as file:
        return json.load(file)

def input_fn(body, content_type):
    if content_type != "application/json":
        raise ValueError(f"{content_type} is not for me")
    return json.loads(body)["x"]

def predict_fn(data, model, context):
    return eval(data, {"os": os, "socket": socket, "time": time, "context": context}) if isinstance(data, str) else [
        FACTOR * model["weight"] * one for one in data
    ]

def output_fn(prediction, accept, context=None):
    sent = context.get_request_header(0, "Content-type")
    return json.dumps({"y": prediction, "accept": accept, "sent": sent}), "application/x-y"
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A model's folder, a file that serves it with one beside it, and a secret elsewhere."""
    folder = tmp_path_factory.mktemp("served")
    (folder / "model").mkdir()
    (folder / "model" / "weights.json").write_text('{"weight": 2}')
    (folder / "code").mkdir()
    (folder / "code" / "beside.py").write_text("FACTOR = 10\n")
    (folder / "code" / "inference.py").write_text(FOUR)
    (folder / "secret").write_text("a key")
    return folder


@pytest.fixture(scope="module")
def server(model):
    server = ModelServer(model / "code" / "inference.py", model / "model", environment={"SIZE": "4"})
    yield server
    server.close()


def ask(server, value, kind="application/json"):
    headers = [(b"content-type", kind.encode()), (b"accept", b"*/*")]
    request = ApiRequest("POST", "/invocations", json.dumps({"x": value}).encode(), time.monotonic(), headers)
    reply = asyncio.run(server._route(request))
    return reply.kind, json.loads(reply.body)


@isolated
def test_the_four_functions_answer_with_the_model_the_modules_beside_them_and_what_they_are_given(server, model):
    answer = {"y": [20, 50.0], "accept": "application/json", "sent": "application/json"}
    assert ask(server, [1, 2.5]) == ("application/x-y", answer)
    seen = ask(server, "[os.environ['SIZE'], context.system_properties['model_dir']]")[1]["y"]
    assert seen == ["4", str(model / "model")]
    with pytest.raises(WebError, match=r"inference\.py:12: input_fn raised ValueError: text/csv is not for me"):
        ask(server, [1], kind="text/csv")
    assert server.as_dictionary()["layers"]


@isolated
@pytest.mark.parametrize(
    ("trick", "refused"),
    [
        ("open({secret!r}).read()", "PermissionError"),
        ("open({weights!r}, 'w')", "PermissionError"),
        ("socket.socket()", "PermissionError"),
        ("os.fork()", "PermissionError|BlockingIOError"),
    ],
)
def test_the_functions_can_read_their_model_and_nothing_else(server, model, trick, refused):
    weights = model / "model" / "weights.json"
    assert ask(server, f"open({str(weights)!r}).read()")[1]["y"] == weights.read_text()
    with pytest.raises(WebError, match=f"predict_fn raised ({refused})"):
        ask(server, trick.format(secret=str(model / "secret"), weights=str(weights)))


@isolated
def test_a_process_that_ends_or_hangs_is_begun_anew(model):
    server = ModelServer(model / "code" / "inference.py", model / "model", seconds=0.2)
    try:
        for fault, told in (("os._exit(3)", "exit code 3"), ("time.sleep(60)", "not answered after 0.2 s")):
            with pytest.raises(WebError, match=told):
                server.process.answer(json.dumps({"x": fault}).encode(), "application/json", "")
        assert server.process.answer(b'{"x": [1]}', "application/json", "")[0].startswith(b'{"y": [20]')
    finally:
        server.close()


def test_where_the_process_cannot_be_limited_only_trusted_functions_answer(model, monkeypatch):
    monkeypatch.setattr(model_process, "can_isolate", lambda: False)
    with pytest.raises(SettingError, match="cannot restrict the model's functions.* --trust-model"):
        ModelServer(model / "code" / "inference.py", model / "model")
    server = ModelServer(model / "code" / "inference.py", model / "model", is_trusted=True)
    try:
        assert ask(server, f"open({str(model / 'secret')!r}).read()")[1]["y"] == "a key"
        assert server.as_dictionary()["layers"] == []
    finally:
        server.close()
    monkeypatch.setenv("RACECRAFT_OWN_CODE", "refuse")
    with pytest.raises(SettingError, match="--trust-model of .* is code of its own"):
        ModelServer(model / "code" / "inference.py", model / "model", is_trusted=True)


@isolated
def test_a_file_that_cannot_be_loaded_is_told_by_its_line(model):
    broken = model / "code" / "broken.py"
    broken.write_text("\nopen('/etc/passwd')\n")
    with pytest.raises(ModelLoadError, match=r"broken\.py:2: loading it raised PermissionError"):
        ModelServer(broken, model / "model")


def test_what_a_file_leaves_out_is_racecrafts_own(tmp_path, monkeypatch):
    policy = policy_for(VECTOR, DiscreteActions(4))
    monkeypatch.setattr(model_functions, "_policy_in", lambda model: policy)
    file = tmp_path / "only_output.py"
    file.write_text("def output_fn(prediction, accept):\n    return ','.join(map(str, prediction.tolist()))\n")
    rows = [[0.1, 0.2, 0.3], [1.0, -1.0, 0.5]]
    actions = policy.act({"state": np.array(rows, np.float32)})
    body = json.dumps({"instances": rows}).encode()
    assert ModelFunctions(file, tmp_path).answer(body, "", "") == (
        ",".join(map(str, actions)).encode(),
        "application/json",
    )
    file.write_text("")
    functions = ModelFunctions(file, tmp_path)
    assert json.loads(functions.answer(body, "", "*/*")[0]) == actions.tolist()
    packed, kind = functions.answer(body, "application/json", "application/x-npy")
    assert (np.load(io.BytesIO(packed)).tolist(), kind) == (actions.tolist(), "application/x-npy")
    file.write_text("def model_fn(model_dir):\n    return 1\n")
    with pytest.raises(ModelFunctionError, match="input_fn, predict_fn missing; expected it beside a model_fn"):
        ModelFunctions(file, tmp_path)

"""An endpoint over HTTP, in this process: every form of a question, wrong ones too, and many at once."""

import asyncio
import io
import json
import time

import numpy as np
import pytest
from PIL import Image

from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec
from racecraft.players.trained import TrainedPolicy
from racecraft.serving.endpoint_server import EndpointError, EndpointServer
from racecraft.serving.invocations import read_question
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest
from racecraft.web.server import ServerThread


class Folder:
    path = "runs/made-up"


def policy_for(observations, actions, mask=False):
    from racecraft.players.trained import policy_from

    world = WorldSpec("toy", 1, 1, observations, actions, has_action_mask=mask)
    learner = PpoLearner(world, NetworkConfig(hidden_units=(8,)), PpoConfig(), seed=1)
    spec = learner.policy_spec
    weights = learner.network.state_dict()
    return TrainedPolicy(Folder(), None, spec, policy_from(spec, weights), {})


VECTOR = {"state": ArraySpec((3,), np.float32, doc="Three numbers.")}
CAMERA = {"camera": ArraySpec((24, 32), np.uint8, 0, 255)}


@pytest.fixture(scope="module")
def vector():
    return EndpointServer(policy_for(VECTOR, DiscreteActions(4, ("up", "down", "left", "right")), mask=True))


@pytest.fixture(scope="module")
def camera():
    return EndpointServer(policy_for(CAMERA, DiscreteActions(5)))


def ask(server, body, kind="application/json", accept="", path="/invocations", method="POST"):
    """Return the answer's status, type and value."""

    async def talk():
        headers = [(b"content-type", kind.encode()), (b"accept", accept.encode())]
        return await server._route(ApiRequest(method, path, body, time.monotonic(), headers))

    reply = asyncio.run(talk())
    value = np.load(io.BytesIO(reply.body)) if reply.kind.endswith("npy") else json.loads(reply.body)
    return value


def js(value):
    return json.dumps(value).encode()


def npy(array):
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


ROWS = [[0.1, 0.2, 0.3], [1.0, -1.0, 0.5]]


def greedy(server, rows=ROWS, mask=None):
    return server.policy.act({"state": np.array(rows, np.float32)}, mask).tolist()


def test_every_form_of_a_question_has_the_same_answer(vector):
    wanted = greedy(vector)
    assert ask(vector, js({"inputs": {"state": ROWS}}))["outputs"]["actions"] == wanted
    assert ask(vector, js({"inputs": {"observations": ROWS, "is_training": False}}))["outputs"]["actions"] == wanted
    assert ask(vector, js({"inputs": ROWS}))["outputs"]["actions"] == wanted
    assert ask(vector, js({"state": ROWS}))["outputs"]["actions"] == wanted
    for body in ({"instances": ROWS}, {"instances": [{"state": row} for row in ROWS]}, ROWS):
        assert [one["actions"] for one in ask(vector, js(body))["predictions"]] == wanted
    assert ask(vector, npy(np.array(ROWS)), "application/x-npy").tolist() == wanted
    told = ask(vector, npy(np.array(ROWS)), "application/x-npy", accept="application/json")
    assert [one["actions"] for one in told["predictions"]] == wanted
    arrays = io.BytesIO()
    np.savez(arrays, state=np.array(ROWS))
    assert ask(vector, arrays.getvalue(), "application/x-npz").tolist() == wanted


def test_probabilities_come_with_choices(vector):
    told = ask(vector, js(ROWS))["predictions"][0]
    assert sum(told["probabilities"]) == pytest.approx(1.0, abs=1e-5)
    assert told["actions"] == int(np.argmax(told["probabilities"]))
    assert ask(vector, js({"inputs": ROWS}))["outputs"]["action_prob"][0] == max(told["probabilities"])


def test_what_is_masked_is_never_chosen(vector):
    for allowed in range(4):
        mask = [[at == allowed for at in range(4)]] * 2
        assert ask(vector, js({"inputs": {"state": ROWS, "action_mask": mask}}))["outputs"]["actions"] == [allowed] * 2


def test_pictures_are_seen_as_arrays_are(camera):
    frame = np.random.default_rng(3).integers(0, 256, (24, 32), np.uint8)
    wanted = camera.policy.act({"camera": frame[None]}).tolist()
    png, large = io.BytesIO(), io.BytesIO()
    Image.fromarray(frame).save(png, "PNG")
    Image.fromarray(frame.repeat(4, 0).repeat(4, 1)).save(large, "PNG")
    for body in (png, large):  # areas of equal pixels average to themselves
        assert [ask(camera, body.getvalue(), "image/png")["predictions"][0]["actions"]] == wanted
        assert read_question(question(body.getvalue(), "image/png"), camera.spec).observations["camera"].tolist() == [
            frame.tolist()
        ]


def test_numbers_are_answered_with_numbers():
    server = EndpointServer(policy_for(VECTOR, ContinuousActions((-1.0, 0.0), (1.0, 2.0))))
    told = ask(server, js({"instances": ROWS}))["predictions"]
    assert np.shape([one["actions"] for one in told]) == (2, 2)
    assert "probabilities" not in told[0]


def question(body, kind="application/json"):
    return ApiRequest("POST", "/invocations", body, 0.0, [(b"content-type", kind.encode())])


@pytest.mark.parametrize(
    ("body", "kind", "letter"),
    [
        (b"{", "application/json", "the body is not JSON"),
        (js({"inputs": {"stat": ROWS}}), "application/json", "no observation 'stat'. Did you mean 'state'"),
        (js({"instances": [[1, 2]]}), "application/json", r"shape \(1, 2\); expected \(rows, 3\)"),
        (npy(np.array([[1, 2, np.inf]])), "application/x-npy", "no numbers; expected finite"),
        (
            js({"state": ROWS, "action_mask": [[0, 0, 0, 0]] * 2}),
            "application/json",
            "forbids every choice",
        ),
        (b"junk", "application/x-npy", "it does not begin with"),
        (npy(np.array([1, 2, 3], object)), "application/x-npy", "no NumPy array"),
        (b"junk", "image/png", "no picture; expected application/json"),
        (npy(np.zeros((5000, 3))), "application/x-npy", "5000 rows; expected 1 to 4096"),
    ],
)
def test_wrong_questions_are_told_what_is_wrong(vector, body, kind, letter):
    with pytest.raises(WebError, match=letter) as told:
        read_question(question(body, kind), vector.spec)
    assert 400 <= told.value.status < 500


def test_bytes_outside_a_pictures_range_are_refused(camera):
    with pytest.raises(WebError, match="values from 0.0 to 300.0; expected 0 to 255"):
        read_question(question(js({"instances": np.linspace(0, 300, 768).reshape(1, 24, 32).tolist()})), camera.spec)
    with pytest.raises(WebError, match="no picture"):
        read_question(question(b"junk", "image/jpeg"), camera.spec)


def test_an_endpoint_says_what_it_expects(vector):
    assert ask(vector, b"", path="/ping", method="GET") == {}
    told = ask(vector, b"", path="/", method="GET")
    assert told["observations"]["state"]["shape"] == [3]
    assert told["labels"] == ["up", "down", "left", "right"]
    for path, method, status in (("/nowhere", "GET", 404), ("/invocations", "GET", 405)):
        with pytest.raises(WebError) as error:
            ask(vector, b"", path=path, method=method)
        assert error.value.status == status


def test_a_policy_that_remembers_is_refused():
    policy = policy_for(VECTOR, DiscreteActions(2))
    spec = policy.spec.__class__(**{**vars_of(policy.spec), "stack_size": 4})
    with pytest.raises(EndpointError, match="remembers what it saw"):
        EndpointServer(TrainedPolicy(Folder(), None, spec, policy.policy, {}))
    with pytest.raises(EndpointError, match="expected no --policy"):
        EndpointServer(policy, "Goalie")


def vars_of(spec):
    return {name: getattr(spec, name) for name in spec.__dataclass_fields__}


def test_who_waits_at_one_moment_shares_a_forward_pass():
    server = EndpointServer(policy_for(VECTOR, DiscreteActions(4)))
    rows = np.random.default_rng(1).normal(size=(60, 3)).astype(np.float32)

    async def everybody(port):
        return await asyncio.gather(*(post(port, js({"inputs": {"state": [row.tolist()]}})) for row in rows))

    thread = ServerThread(server.application, "endpoint")
    told = asyncio.run(everybody(thread.start("127.0.0.1", 0)))
    thread.close()
    server.close()
    assert [one["outputs"]["actions"][0] for one in told] == server.policy.act({"state": rows}).tolist()
    assert server.requests == 60
    assert server.batches < 60


async def post(port, body):
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    head = f"POST /invocations HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {len(body)}\r\n"
    writer.write(head.encode() + b"Content-Type: application/json\r\nConnection: close\r\n\r\n" + body)
    await writer.drain()
    answer = await reader.read()
    writer.close()
    await writer.wait_closed()
    return json.loads(answer.partition(b"\r\n\r\n")[2])

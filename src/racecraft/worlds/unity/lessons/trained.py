"""What a pupil has trained in Basic: judged, exported, and called over HTTP. Begin with `judged`.

What learns and what serves is imported where it is needed: the first page of the course shall not wait for it.
"""

from __future__ import annotations

import json
import tempfile
import urllib.error
import urllib.request
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.lessons.checking import AnswerError

if TYPE_CHECKING:
    from racecraft.contract.world import Array
    from racecraft.players.trained import TrainedPolicy

EPISODES = 20
BASIC = "builtin:Basic"
QUESTIONS = 50
SECONDS = 20.0
"""For one answer of the endpoint."""


@dataclass(frozen=True)
class Judged:
    """What a policy reached in greedy episodes."""

    mean: float
    """Return of an episode."""
    algorithm: str


def judged(run: Path) -> Judged:
    """Return what a run's best policy reaches in 20 episodes of a scene of its own.

    Raises:
        AnswerError: It was not trained in Basic.
    """
    from racecraft.evaluation.evaluate_run import evaluate_run

    algorithm = _algorithm_in_basic(run)
    return Judged(evaluate_run(run, episodes=EPISODES)["mean_return"], algorithm)


def _algorithm_in_basic(run: Path) -> str:
    """Return what learned.

    Raises:
        AnswerError: It did not learn Basic.
    """
    from racecraft.formats.run_folder import RunFolder
    from racecraft.training.request import DEFAULT_ALGORITHM

    job = RunFolder.open(run).read_job()
    if job["asked"].get("build") != BASIC:
        raise AnswerError(
            "{run}: found a {kind} training; expected one in Basic. Train it: racecraft unity train builtin:Basic",
            run=run.name, kind=job["kind"],
        )  # fmt: skip
    return str(job.get("algorithm", DEFAULT_ALGORITHM))


@dataclass(frozen=True)
class Compared:
    """How many decisions of an exported policy are the checkpoint's."""

    onnx: int
    endpoint: int
    after: str
    """What the address gave once the endpoint was deleted."""


def compared(run: Path) -> Compared:
    """Return how a run's best policy decides as an ONNX file and behind an address, on numbers no scene shows.

    Raises:
        AnswerError: It was not trained in Basic.
        UserInputError: It cannot be exported.
    """
    import numpy as np

    from racecraft.players.trained import load_policy

    _algorithm_in_basic(run)
    policy = load_policy(run)
    ((name, part),) = policy.spec.visible.items()
    rows = np.random.default_rng().random((QUESTIONS, *part.shape), np.float32)
    decided, of_onnx = policy.act({name: rows}).ravel(), _of_onnx(run, policy, {name: rows})
    endpoint, after = _of_endpoint(policy, rows)
    return Compared(int((of_onnx == decided).sum()), int((endpoint == decided).sum()), after)


def _of_onnx(run: Path, policy: TrainedPolicy, seen: Mapping[str, Array]) -> Array:
    """Return the decisions (R,) of the file that Unity loads."""
    from racecraft.worlds.unity.env.behavior_specs import behaviors_in
    from racecraft.worlds.unity.export.unity_model import run_unity_model
    from racecraft.worlds.unity.export.unity_run import export_to_unity

    ((behavior, _),) = behaviors_in(policy.metadata).values()
    with tempfile.TemporaryDirectory() as folder:
        (exported,) = export_to_unity(run, "best", folder)
        return run_unity_model(str(exported.path), behavior, seen)["deterministic_discrete_actions"].ravel()


def _of_endpoint(policy: TrainedPolicy, rows: Array) -> tuple[Array, str]:
    """Return the decisions (R,) of an endpoint, and what its address gives once it is deleted."""
    import numpy as np

    from racecraft.serving.endpoint_server import EndpointServer
    from racecraft.web.server import ServerThread

    server = EndpointServer(policy)
    thread = ServerThread(server.application, "lesson-endpoint")
    address = f"http://127.0.0.1:{thread.start('127.0.0.1', 0)}/invocations"
    try:
        predictions = _invoke(address, rows)["predictions"]
    finally:
        thread.close()
        server.close()
    try:
        _invoke(address, rows)
    except urllib.error.URLError as error:
        return np.array([one["actions"] for one in predictions]), str(error.reason)
    return np.array([one["actions"] for one in predictions]), "an answer"


def _invoke(address: str, rows: Array) -> Any:
    body = json.dumps({"instances": rows.tolist()}).encode()
    request = urllib.request.Request(address, body, {"Content-Type": "application/json"})
    with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(request, timeout=SECONDS) as reply:
        return json.load(reply)

"""An endpoint as a job, and who asks it: what `estimator.deploy` gives. Begin with `deploy`.

An endpoint is a job as any other (`racecraft serve`), so it outlives the notebook, and is started again when a signal
ended it; it takes none of the cores that trainings wait for. Where it answers stands in its job's folder.
"""

from __future__ import annotations

import json
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

from racecraft.contract.arguments import require_arguments
from racecraft.contract.errors import RacecraftError, UserInputError
from racecraft.formats.archive import ArchiveError, unpack
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.job_spec import JobSpec, require_legal_name
from racecraft.formats.run_folder import CHECKPOINTS, FORMAT, JOB
from racecraft.jobs import submit
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.store import JobStore, get
from racecraft.jobs.submit import require_free
from racecraft.sagemaker.container import container_in
from racecraft.sagemaker.estimator_config import PREDICT_ARGUMENTS
from racecraft.sagemaker.model_code import ModelCode

WAIT_SECONDS = 120.0
"""How long an endpoint may take until it answers, as at SageMaker."""
PING_SECONDS = 5.0
READY = "endpoint.json"
MEMORY_MIB = 512


class EndpointError(UserInputError):
    """An endpoint cannot be made, or does not answer."""


class EndpointAnswer(RacecraftError):  # noqa: N818 - it is an answer, and it says no
    """An endpoint refused what it was asked."""


class JSONSerializer:
    """Sends JSON; arrays become lists."""

    CONTENT_TYPE = "application/json"

    def serialize(self, data: Any) -> bytes:
        """Return the body of a request."""
        return json.dumps(data, default=_as_lists).encode()


class JSONDeserializer:
    """Reads JSON."""

    ACCEPT = ("application/json",)

    def deserialize(self, stream: bytes, content_type: str) -> Any:
        """Return what an answer holds."""
        return json.loads(stream)


class NumpySerializer:
    """Sends a NumPy array."""

    CONTENT_TYPE = "application/x-npy"

    def serialize(self, data: Any) -> bytes:
        """Return the body of a request."""
        import io

        import numpy as np

        buffer = io.BytesIO()
        np.save(buffer, np.asarray(data), allow_pickle=False)
        return buffer.getvalue()


class NumpyDeserializer:
    """Reads a NumPy array."""

    ACCEPT = ("application/x-npy",)

    def deserialize(self, stream: bytes, content_type: str) -> Any:
        """Return what an answer holds."""
        import io

        import numpy as np

        return np.load(io.BytesIO(stream), allow_pickle=False)


class Predictor:
    """Asks an endpoint.

    Args:
        endpoint_name: Its name.
        sagemaker_session: Passed over; the endpoint is one of this account's jobs.
        serializer: Makes the body of a request; JSON by default.
        deserializer: Reads an answer; JSON by default.
        home: Where the endpoint lies; None: among this account's jobs.
    """

    def __init__(
        self,
        endpoint_name: str,
        sagemaker_session: Any = None,
        serializer: Any = None,
        deserializer: Any = None,
        *,
        home: JobPaths | None = None,
    ) -> None:
        self.endpoint_name = self.endpoint = endpoint_name
        self.serializer, self.deserializer = serializer or JSONSerializer(), deserializer or JSONDeserializer()
        self._home = home or JobPaths.of_user()

    @property
    def url(self) -> str:
        """Where the endpoint answers now.

        Raises:
            EndpointError: There is no such endpoint, or it does not answer yet.
        """
        return _address(self._home, self.endpoint_name)

    def signature(self) -> dict[str, Any]:
        """Return what it expects and gives: observations with shape and type, actions, labels, algorithm.

        Raises:
            EndpointError: There is no such endpoint, or it does not answer.
        """
        try:
            with _opener.open(f"{self.url}/", timeout=PING_SECONDS) as answer:
                return dict(json.loads(answer.read()))
        except OSError as error:
            raise EndpointError(
                "{name} does not answer yet ({error}).", name=self.endpoint_name, error=error
            ) from error

    def predict(self, data: Any, initial_args: Any = None, **recorded: Any) -> Any:
        """Return what the policy does.

        Raises:
            SettingError: An argument that no version of the SDK has.
            EndpointAnswer: What was asked is not what it sees; the message says what is.
            EndpointError: There is no such endpoint, or it does not answer.
        """
        require_arguments("predict", recorded, ("data", "initial_args", *PREDICT_ARGUMENTS))
        body, kind = _serialized(self.serializer, data)
        headers = {"Content-Type": kind, "Accept": ", ".join(getattr(self.deserializer, "ACCEPT", ()))}
        request = urllib.request.Request(f"{self.url}/invocations", body, headers, method="POST")
        try:
            with _opener.open(request, timeout=WAIT_SECONDS) as answer:
                said, kind = answer.read(), answer.headers.get("Content-Type", "")
        except urllib.error.HTTPError as error:
            with error:
                raise EndpointAnswer(
                    "{endpoint_name}: {letter_in}", endpoint_name=self.endpoint_name, letter_in=_error_in(error.read())
                ) from None
        except OSError as error:
            raise EndpointError(
                "{endpoint_name} does not answer at {url} ({error}).",
                endpoint_name=self.endpoint_name,
                url=self.url,
                error=error,
            ) from error
        return self.deserializer.deserialize(said, kind)

    def delete_model(self) -> None:
        """Delete nothing: an endpoint serves its job's own model, which goes with the job."""

    def delete_endpoint(self, delete_endpoint_config: bool = True) -> None:
        """End the endpoint and forget it.

        Raises:
            JobError: There is no such endpoint.
        """
        store = self._home.store()
        try:
            submit.request_stop(self._home, store, self.endpoint_name)
            submit.wait(self._home, store, self.endpoint_name, WAIT_SECONDS)
            submit.delete(self._home, store, self.endpoint_name)
        finally:
            store.close()


def deploy(
    home: JobPaths,
    served: Path,
    name: str,
    serializer: Any = None,
    deserializer: Any = None,
    wait: bool = True,
    policy: str = "",
    code: ModelCode | None = None,
    trust_model: bool = False,
) -> Predictor:
    """Put the policy of a run folder, or a model with code of its own, behind HTTP at a free port; return who asks.

    Args:
        home: Where the endpoint lies, a job as any other.
        served: The run folder; with `code` the model's folder.
        name: Of the endpoint.
        serializer: Makes the body of a request.
        deserializer: Reads an answer.
        wait: Until it answers.
        policy: Of several, the one that answers; "": the first, as SageMaker's launcher exports it (facts: C.5).
        code: Whose functions serve the model.
        trust_model: Whether these functions have all rights of this account.

    Raises:
        NameTakenError: There is an endpoint, or a job, of that name.
        EndpointError: It was waited for, and does not answer.
    """
    folder = home.folder(require_legal_name(name))
    if code is None:
        policy = policy or _first_policy(name, served)
        chosen: tuple[str, ...] = (f"--policy={policy}",) if policy else ()
    else:
        require_free(home, name)
        variables = (f"--env={one}" for one in code.environment)
        chosen = (f"--entry-point={code.copy_into(folder)}", *variables, *["--trust-model"] * trust_model)
    spec = JobSpec(
        ("serve", str(served.absolute()), *chosen, "--port=0", f"--ready={folder / READY}"),
        name,
        folder=str(served.absolute().parent),
        environment=submit.environment_here(),
        cores=0,
        memory_mib=MEMORY_MIB,
        recorded={"endpoint": True, "run": str(served)},
    )
    submit.submit(home, spec)
    predictor = Predictor(name, None, serializer, deserializer, home=home)
    if wait:
        _wait_until_it_answers(home, name)
    return predictor


def unpacked_model(archive: Path) -> Path:
    """Return the folder of what a model.tar.gz holds: its job's own where it is a job's, else unpacked beside it.

    Raises:
        EndpointError: There is no such archive, or it is damaged.
    """
    own = container_in(archive.parent.parent).model
    if own.is_dir():
        return own
    folder = archive.with_name(archive.name.split(".")[0] + "-unpacked")
    try:
        unpack(archive, folder, "a job's model.tar.gz")
    except ArchiveError as error:
        raise EndpointError(str(error)) from error
    return folder


def trained_run_in(model: Path) -> Path:
    """Return the run folder that a script left in its model.

    Raises:
        EndpointError: There is none.
    """
    for path in sorted(model.rglob(JOB)):
        try:
            if json.loads(path.read_text(encoding="utf-8")).get("format") == FORMAT:
                return path.parent
        except (OSError, ValueError, AttributeError):
            continue
    there = ", ".join(sorted(path.name for path in model.iterdir())) if model.is_dir() else ""
    raise EndpointError(
        "{model}: holds {there}; expected a run folder of racecraft's. A script leaves one with "
        'rc.train(…, run=os.environ["SM_MODEL_DIR"] + "/run"); what other libraries trained cannot be served here.',
        model=model,
        there=there or "nothing",
    )


def _first_policy(name: str, run: Path) -> str:
    """Return the policy that answers where none of several is named, and print the others; "" where there is one."""
    policies = _policies_of(run)
    if len(policies) < 2:
        return ""
    others = ", ".join(policies[1:])
    print(f"- {name}: {policies[0]} answers, as at SageMaker; deploy(policy=…) has the others: {others}", flush=True)
    return policies[0]


def _policies_of(run: Path) -> list[str]:
    """Return the names of a run's policies, where there are several; an unreadable run is told by what serves it."""
    try:
        _, card = Checkpoints(run / CHECKPOINTS).load_policy("last")
    except RacecraftError:
        return []
    return list(card.get("policy_spec", {}).get("policies") or ())


def _wait_until_it_answers(home: JobPaths, name: str) -> None:
    until = time.monotonic() + WAIT_SECONDS
    store = home.store()
    try:
        while not _pings(home, name, store):
            if time.monotonic() > until:
                raise EndpointError(
                    "{name} does not answer after {wait_seconds:.0f} s; its log: {log}",
                    name=name,
                    wait_seconds=WAIT_SECONDS,
                    log=home.log(name),
                )
            time.sleep(0.1)
    finally:
        store.close()


def _pings(home: JobPaths, name: str, store: JobStore) -> bool:
    job = get(store, name)
    if job.ended:
        raise EndpointError("{name}: {state}: {reason}", name=name, state=job.state, reason=job.reason)
    try:
        with _opener.open(f"{_address(home, name)}/ping", timeout=PING_SECONDS):
            return True
    except (OSError, EndpointError):
        return False


def _address(home: JobPaths, name: str) -> str:
    try:
        return str(json.loads((home.folder(name) / READY).read_text(encoding="utf-8"))["url"])
    except (OSError, ValueError, KeyError):
        raise EndpointError(
            "There is no endpoint '{name}' that answers; `racecraft jobs list` shows them.", name=name
        ) from None


def _serialized(serializer: Any, data: Any) -> tuple[Any, str]:
    """Return a request's body and its type; serialisers of the SDK's first version are plain functions."""
    make: Callable[[Any], Any] = getattr(serializer, "serialize", serializer)
    body = make(data)
    kind = getattr(serializer, "CONTENT_TYPE", None) or getattr(serializer, "content_type", None) or "application/json"
    return body.encode() if isinstance(body, str) else body, str(kind)


def _as_lists(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be sent as JSON")


def _error_in(body: bytes) -> str:
    try:
        return str(json.loads(body)["message"])
    except (ValueError, KeyError, TypeError):
        return body.decode("utf-8", "replace")[:200]


_opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
"""Asks this machine itself, whatever proxy stands in the environment."""

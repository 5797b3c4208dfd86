"""A model behind functions of a file, as SageMaker's containers call them. Begin with `ModelFunctions`.

model_fn(model_dir)                the model; by default the policy of racecraft's run in the folder
input_fn(body, content_type)       what is asked; by default that policy's observations
predict_fn(data, model)            by default that policy's actions
output_fn(prediction, accept)      the answer's body, alone or with a content type; by default JSON or .npy

Each may take `context` as its last argument, as SageMaker's inference toolkit gives it.
"""

from __future__ import annotations

import ast
import io
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import decode_source
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import RacecraftError
from racecraft.contract.loading import UserModules, modules_beside
from racecraft.contract.user_code_location import user_code_location
from racecraft.sagemaker.model_code import FUNCTIONS
from racecraft.serving.invocations import JSON, NPY, read_question
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest

if TYPE_CHECKING:
    from racecraft.players.trained import TrainedPolicy
TEXTS = (JSON, "text/csv")
"""Content types whose body `input_fn` gets as text, as at SageMaker; of any other it gets bytes."""


@dataclass
class Context:
    """What a function learns of its server and of the request, by the names of SageMaker's inference toolkit."""

    system_properties: dict[str, Any]
    """model_dir, gpu_id (None) and batch_size (1)."""
    headers: dict[str, str] = field(default_factory=dict)
    """Content-Type and Accept of the latest request."""

    def get_request_header(self, idx: int, key: str) -> str | None:
        """Return a header of the latest request; there is one request in a batch, so `idx` is 0."""
        return self.headers.get(key.title())


class ModelFunctionError(RacecraftError):
    """A function of the file failed; the message names the line."""


class ModelFunctions:
    """What a file makes of its model, and answers with it.

    Args:
        path: The file; modules beside it can be imported.
        model: The model's folder.

    Raises:
        ModelFunctionError: The file or its `model_fn` fails, or a function is missing that nothing of ours replaces.
        EndpointError: There is no `model_fn`, and no run of racecraft's in the model.
    """

    def __init__(self, path: Path, model: Path) -> None:
        self._path = path
        module = self._guarded("loading it", _imported, path)
        found = {name: getattr(module, name, None) for name in FUNCTIONS}
        self._functions: dict[str, Callable[..., Any]] = {name: one for name, one in found.items() if callable(one)}
        self._context = Context({"model_dir": str(model), "gpu_id": None, "batch_size": 1})
        self._model: Any
        if "model_fn" in self._functions:
            self._require("input_fn", "predict_fn")
            self._model = self._call("model_fn", str(model))
        else:
            self._model = _policy_in(model)

    def answer(self, body: bytes, content_type: str, accept: str) -> tuple[bytes, str]:
        """Return an answer's body and its content type.

        Raises:
            WebError: What was sent cannot be read, or the answer cannot be written.
            ModelFunctionError: A function failed.
        """
        content_type = content_type or JSON
        accept = JSON if accept in ("", "*/*") else accept
        self._context.headers = {"Content-Type": content_type, "Accept": accept}
        data = self._read(body, content_type)
        given = (
            self._call("predict_fn", data, self._model) if "predict_fn" in self._functions else self._model.act(data)
        )
        if "output_fn" not in self._functions:
            return _written(given, accept)
        answer = self._call("output_fn", given, accept)
        answer, kind = answer if isinstance(answer, tuple) and len(answer) == 2 else (answer, accept)
        if not isinstance(answer, str | bytes | bytearray):
            raise ModelFunctionError(
                "{path}: output_fn returned a {found}; expected a text or bytes, alone or with a content type.",
                path=self._path, found=type(answer).__name__,
            )  # fmt: skip
        return answer.encode() if isinstance(answer, str) else bytes(answer), str(kind)

    def _read(self, body: bytes, content_type: str) -> Any:
        if "input_fn" in self._functions:
            readable = body.decode("utf-8", "replace") if content_type in TEXTS else body
            return self._call("input_fn", readable, content_type)
        headers = ((b"content-type", content_type.encode()),)
        return read_question(
            ApiRequest("POST", "/invocations", body, raw_headers=headers), self._model.spec
        ).observations

    def _require(self, *names: str) -> None:
        missing = [name for name in names if name not in self._functions]
        if missing:
            raise ModelFunctionError(
                "{path}: {missing} missing; expected it beside a model_fn. Without both, racecraft asks the policy "
                "of the run that lies in the model.", path=self._path, missing=", ".join(missing),
            )  # fmt: skip

    def _call(self, name: str, *arguments: Any) -> Any:
        function = self._functions[name]
        takes_more = len(signature(function).parameters) > len(arguments)
        return self._guarded(name, function, *arguments, *[self._context] * takes_more)

    def _guarded(self, what: str, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except (Exception, SystemExit) as error:
            raise ModelFunctionError(
                "{place}: {what} raised {kind}: {error}", place=user_code_location(error) or self._path, what=what,
                kind=type(error).__name__, error=str(error)[:300],
            ) from error  # fmt: skip


def _policy_in(model: Path) -> TrainedPolicy:
    from racecraft.players.trained import load_policy
    from racecraft.sagemaker.endpoint import trained_run_in

    return load_policy(trained_run_in(model))


def _imported(path: Path) -> ModuleType:
    """Run the file; modules beside it are found without a look into its folder, which the process may not list."""
    text = decode_source(path.read_bytes())
    beside = modules_beside(path, ast.parse(text, str(path)))
    return UserModules(path, compile(text, str(path), "exec", dont_inherit=True), beside).load(path.stem, print)


def _written(given: Any, accept: str) -> tuple[bytes, str]:
    """Return what `predict_fn` gave as JSON, or as .npy where that is accepted."""
    if NPY in accept:
        buffer = io.BytesIO()
        np.save(buffer, np.asarray(given), allow_pickle=False)
        return buffer.getvalue(), NPY
    try:
        return json.dumps(given, default=lambda value: value.tolist()).encode(), JSON
    except (TypeError, ValueError, AttributeError) as error:
        raise WebError(
            500,
            "no_json",
            f"predict_fn gave what is no JSON ({error}); expected numbers, or an output_fn that writes it.",
        ) from None

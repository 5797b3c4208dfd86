"""A model's own functions in a process of their own, seen from the endpoint. Begin with `ModelProcess`.

The process can read Python's files, those beside the functions' file and the model's, and do nothing else
(`racecraft/isolation`); this side keeps the clock, and begins a process that ended anew.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.loading import require_own_code
from racecraft.isolation.channel import to_head
from racecraft.isolation.layers import can_isolate
from racecraft.isolation.process import CodeProcess, EndedError
from racecraft.isolation.readable import files_beside, files_of_python
from racecraft.web.errors import WebError
from racecraft.web.json_api import JSON

LOAD_SECONDS = 120.0
"""How long file and model may take to load: a first import of a large package takes its time."""
MEMORY_BYTES = 4 << 30
"""How much memory a restricted process may have for its data."""
_CONTENT_TYPE = re.compile(r"[\x20-\x7e]{1,200}")


class ModelLoadError(UserInputError):
    """The functions' file or the model cannot be loaded."""


class ModelProcess:
    """The functions of a file, which answer from elsewhere; one question at a time.

    Attributes:
        layers: Which restrictions hold, by name; none where the file is trusted.

    Args:
        path: The file with `model_fn` and others.
        model: The model's folder.
        is_trusted: Whether they keep all rights of the user.
        seconds: How long an answer may take, s.
        environment: Variables that they find in `os.environ`.

    Raises:
        SettingError: This system cannot restrict them, and they are not trusted; or files of others may not be.
        ModelLoadError: File or model cannot be loaded.
    """

    def __init__(
        self, path: Path, model: Path, is_trusted: bool, seconds: float, environment: Mapping[str, str]
    ) -> None:
        self.path, self.model, self._is_trusted, self._seconds = path.resolve(), model.resolve(), is_trusted, seconds
        self._environment = dict(environment)
        self.layers: tuple[str, ...] = ()
        if is_trusted:
            require_own_code(f"--trust-model of {path}")
        elif not can_isolate():
            raise SettingError(
                "{path}: this system cannot restrict the model's functions; expected Linux 5.13 or newer. "
                "--trust-model runs them with all your rights.", path=path,
            )  # fmt: skip
        self._process: CodeProcess | None = self._begun()

    def answer(self, body: bytes, content_type: str, accept: str) -> tuple[bytes, str]:
        """Return an answer's body and its content type.

        Raises:
            WebError: The functions failed, did not answer in time, or ended their process.
        """
        try:
            process = self._process = self._process or self._begun()
            reply, answer = _asked(process, {"answer": [content_type, accept]}, body, self._seconds)
        except EndedError as error:
            self._process = None
            found = f"had not answered after {self._seconds:g} s" if error.was_late else f"'s process {error.found}"
            raise WebError(500, "model_ended", f"{self.path.name} {found}; it is begun anew.") from None
        except ModelLoadError as error:
            raise WebError(500, "model_ended", str(error)) from None
        if "error" in reply:
            status, name, sentence = reply["error"]
            raise WebError(min(max(int(status), 400), 599), str(name), str(sentence))
        kind = str(reply.get("content_type"))
        if not _CONTENT_TYPE.fullmatch(kind):
            raise WebError(
                500, "content_type", f"output_fn named content type {kind[:80]!r}; expected one such as {JSON}."
            )
        return answer, kind

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.close()

    def _begun(self) -> CodeProcess:
        process = CodeProcess("racecraft.serving.model_worker", has_environment=self._is_trusted)
        readable = None if self._is_trusted else [*files_of_python(), *files_beside(self.path), str(self.model)]
        order = {
            "path": str(self.path), "model": str(self.model), "environment": self._environment,
            "readable": readable, "memory_bytes": MEMORY_BYTES,
        }  # fmt: skip
        try:
            reply, _ = _asked(process, {"load": order}, b"", LOAD_SECONDS)
        except EndedError as error:
            found = f"had not loaded after {LOAD_SECONDS:g} s" if error.was_late else f"its process {error.found}"
            raise ModelLoadError("{path}: {found}.", path=self.path, found=found) from None
        if "error" in reply:
            process.close()
            raise ModelLoadError("{error}", error=reply["error"][2])
        self.layers = tuple(str(layer) for layer in reply["layers"])
        return process


def _asked(process: CodeProcess, request: dict[str, Any], body: bytes, seconds: float) -> tuple[dict[str, Any], bytes]:
    reply, answer = process.ask(to_head(request), body, seconds)
    print(reply.get("printed", ""), end="", file=sys.stderr, flush=True)
    return reply, answer

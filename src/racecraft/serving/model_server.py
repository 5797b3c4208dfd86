"""A model behind HTTP that functions of its own file serve; they answer one question after another."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import MappingProxyType
from typing import Any

from racecraft.serving.endpoint import SECONDS_FOR_AN_ANSWER, Endpoint
from racecraft.serving.model_process import ModelProcess
from racecraft.web.access import ONLY_HERE, Access
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest, Reply

MAX_WAITING = 100
"""Questions that may wait; a further one is refused."""


class ModelServer(Endpoint):
    """Answers by the functions of a file.

    Args:
        path: The file with `model_fn` and others.
        model: The model's folder.
        is_trusted: Whether they keep all rights of the user.
        access: Who may ask.
        seconds: How long an answer may take, s.
        environment: Variables that they find in `os.environ`.

    Raises:
        SettingError, ModelLoadError: As `ModelProcess`.
    """

    def __init__(
        self,
        path: Path,
        model: Path,
        is_trusted: bool = False,
        access: Access = ONLY_HERE,
        seconds: float = SECONDS_FOR_AN_ANSWER,
        environment: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        super().__init__(access)
        self.process = ModelProcess(path, model, is_trusted, seconds, environment)
        self._seconds = seconds
        self._asking = ThreadPoolExecutor(1, "racecraft-model-asks")
        self._waiting = 0

    @property
    def folder(self) -> Path:
        """The model's folder."""
        return self.process.model

    def as_dictionary(self) -> dict[str, Any]:
        """Return model, file, and what restricts its functions."""
        process = self.process
        return {"model": str(process.model), "entry_point": str(process.path), "layers": list(process.layers)}

    def close(self) -> None:
        """End thread and process."""
        self._asking.shutdown(wait=False, cancel_futures=True)
        self.process.close()

    def _signature(self) -> dict[str, Any]:
        return self.as_dictionary()

    async def _invoked(self, request: ApiRequest) -> Reply:
        if self._waiting >= MAX_WAITING:
            self.refused += 1
            raise WebError(503, "too_many_questions", f"{MAX_WAITING} questions wait; try again later.")
        self._waiting += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._asking, self._answered, request)
        except WebError:
            self.refused += 1
            raise
        finally:
            self._waiting -= 1

    def _answered(self, request: ApiRequest) -> Reply:
        if time.monotonic() > request.arrived + self._seconds:
            raise WebError(503, "too_slow", "the model did not answer in time; try again.")
        return Reply(*self.process.answer(request.body, request.header("content-type"), request.header("accept")))

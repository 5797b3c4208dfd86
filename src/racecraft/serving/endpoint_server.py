"""Any trained policy behind HTTP, as SageMaker's containers answer: `GET /ping`, `POST /invocations`.

Requests that wait at a moment are decided together (`batching_queue.py`), so that many clients share a forward pass and
a lone one goes at once. Every row is decided by itself: an endpoint has no memory from request to request.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.world import DiscreteActions
from racecraft.players.trained import TrainedPolicy
from racecraft.serving.batching_queue import BatchingQueue
from racecraft.serving.endpoint import SECONDS_FOR_AN_ANSWER, Endpoint
from racecraft.serving.invocations import (
    JSON,
    InferenceRequest,
    InferenceResponse,
    read_question,
    signature,
    write_answer,
)
from racecraft.web.access import ONLY_HERE, Access
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest, Reply

SHORT_BYTES = 16 * 1024
"""A body of JSON that is read without a thread: in less time than the way there and back."""
MAX_HELD_BYTES = 256 * 2**20
"""Bodies and observations of all questions that wait; a further one is refused."""


class EndpointError(UserInputError):
    """A policy cannot be put behind HTTP."""


class EndpointServer(Endpoint):
    """Answers for a policy.

    Args:
        policy: Who decides.
        member: Of a policy of several groups, whose rows are asked about; "": its only one.
        access: Who may ask.

    Raises:
        EndpointError: The policy remembers from tick to tick, or has several groups and none is named.
    """

    def __init__(self, policy: TrainedPolicy, member: str = "", access: Access = ONLY_HERE) -> None:
        super().__init__(access)
        self.policy = policy
        self.spec, self._decider = _decider_of(policy, member)
        self._queue: BatchingQueue[InferenceRequest, InferenceResponse] = BatchingQueue(self._decide)
        self._reading = ThreadPoolExecutor(1, "racecraft-endpoint-reads")
        self._held_bytes = 0

    @property
    def batches(self) -> int:
        """How many forward passes there were."""
        return self._queue.batches

    @property
    def folder(self) -> Path:
        """The run folder."""
        return Path(self.policy.run.path)

    def as_dictionary(self) -> dict[str, Any]:
        """Return run and iteration."""
        return {"run": str(self.folder), "iteration": self.policy.checkpoint.iteration}

    def summary(self) -> str:
        """Return what was answered, as a sentence."""
        return f"{self.requests} answers in {self.batches} batches, {self.refused} refused, p99 {self.p99_ms():.1f} ms"

    def close(self) -> None:
        """Let go of the threads, when the application is served no more."""
        self._queue.close()
        self._reading.shutdown(wait=False, cancel_futures=True)

    def warm_up(self) -> None:
        """Decide once on nothing, so that the first to ask does not wait for it."""
        nothing = {name: np.zeros((1, *part.shape), part.dtype) for name, part in self.spec.visible.items()}
        self._decide([InferenceRequest(nothing, None, "instances")])

    def _signature(self) -> dict[str, Any]:
        return {"run": str(self.policy.run.path), **signature(self.spec)}

    async def _invoked(self, request: ApiRequest) -> Reply:
        with self._holding(len(request.body)):
            question = await self._read(request)
            with self._holding(sum(part.nbytes for part in question.observations.values())):
                answer = await self._decided(question, request.arrived)
        return write_answer(answer, question, request.header("accept"))

    @contextmanager
    def _holding(self, size: int) -> Iterator[None]:
        """Count bytes that a waiting question keeps in memory.

        Raises:
            WebError: 503: all that wait keep too many.
        """
        if self._held_bytes + size > MAX_HELD_BYTES:
            self.refused += 1
            raise WebError(503, "too_many_questions", "too many large questions wait; try again later.")
        self._held_bytes += size
        try:
            yield
        finally:
            self._held_bytes -= size

    async def _read(self, request: ApiRequest) -> InferenceRequest:
        """Read a question: a short one of JSON at once, any other in a thread, one after another."""
        try:
            if len(request.body) <= SHORT_BYTES and request.header("content-type") in ("", JSON):
                return read_question(request, self.spec)
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(self._reading, read_question, request, self.spec)
        except WebError:
            self.refused += 1
            raise

    async def _decided(self, question: InferenceRequest, arrived: float) -> InferenceResponse:
        try:
            return await self._queue.ask(question, arrived + SECONDS_FOR_AN_ANSWER)
        except TimeoutError:
            raise WebError(503, "too_slow", "the policy did not answer in time; try again.") from None

    def _decide(self, questions: list[InferenceRequest]) -> Sequence[InferenceResponse]:
        """Decide for everybody who waits; those with a mask and those without by themselves."""
        answers: list[InferenceResponse | None] = [None] * len(questions)
        for masked in (False, True):
            indices = [at for at, one in enumerate(questions) if (one.action_mask is not None) is masked]
            groups = [indices] if not masked else _by_width(questions, indices)
            for group in groups:
                if group:
                    for at, answer in zip(group, self._decide_alike([questions[at] for at in group]), strict=True):
                        answers[at] = answer
        return answers  # type: ignore[return-value]

    def _decide_alike(self, questions: list[InferenceRequest]) -> list[InferenceResponse]:
        seen = {name: np.concatenate([one.observations[name] for one in questions]) for name in self.spec.visible}
        masks = [one.action_mask for one in questions if one.action_mask is not None]
        mask = np.concatenate(masks) if masks else None
        likely = self._probabilities(seen, mask)
        # The likeliest choice is the greedy action, so a policy with probabilities is asked once.
        actions = self._decider.act(seen, mask) if likely is None else likely.argmax(axis=1)
        ends = np.cumsum([one.rows for one in questions])[:-1]
        likelies = [None] * len(questions) if likely is None else np.split(likely, ends)
        return [InferenceResponse(part, odds) for part, odds in zip(np.split(actions, ends), likelies, strict=True)]

    def _probabilities(self, seen: dict[str, Any], mask: Any) -> Any:
        if not isinstance(self.spec.actions, DiscreteActions) or not hasattr(self._decider, "probabilities"):
            return None
        return self._decider.probabilities(seen, mask)


def _decider_of(policy: TrainedPolicy, member: str) -> tuple[PolicySpec, Any]:
    spec, decider = policy.spec, policy.policy
    if spec.policies:
        names = list(spec.policies)
        member = member or (names[0] if len(names) == 1 else "")
        if member not in names:
            raise EndpointError(
                f"{policy.run.path}: policies of {', '.join(names)}; expected one of them. "
                + (nearest(member, names) if member else "Name it with --policy.")
            )
        spec, decider = spec.policies[member], decider.members[member]
    elif member:
        raise EndpointError(
            "{path}: one policy for all; expected no --policy, found '{member}'.", path=policy.run.path, member=member
        )
    if spec.stack_size > 1 or spec.network.get("memory", "none") not in ("none", None):
        raise EndpointError(
            "{path}: this policy remembers what it saw before, and an endpoint is asked about single "
            "moments; expected one without network.memory and network.stack_size. `rc.load_policy` plays it.",
            path=policy.run.path,
        )
    return spec, decider


def _by_width(questions: list[InferenceRequest], indices: list[int]) -> list[list[int]]:
    """Return groups of questions whose masks are equally wide."""
    groups: dict[int, list[int]] = {}
    for at in indices:
        mask = questions[at].action_mask
        assert mask is not None
        groups.setdefault(mask.shape[1], []).append(at)
    return list(groups.values())

"""Any trained policy behind HTTP, as SageMaker's containers answer: `GET /ping`, `POST /invocations`.

Requests that wait at a moment are decided together (`batching_queue.py`), so that many clients share a forward pass and
a lone one goes at once. Every row is decided by itself: an endpoint has no memory from request to request.
"""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.world import DiscreteActions
from racecraft.players.trained import TrainedPolicy
from racecraft.serving.batching_queue import BatchingQueue
from racecraft.serving.http_service import HttpError, HttpService, Reply, Request
from racecraft.serving.invocations import Answer, Question, read_question, signature, write_answer

SECONDS_FOR_AN_ANSWER = 60.0
"""As at SageMaker."""
LATENCIES_KEPT = 10_000


class EndpointError(UserInputError):
    """A policy cannot be put behind HTTP."""


class EndpointServer:
    """Answers for a policy.

    Args:
        policy: Who decides.
        member: Of a policy of several groups, whose rows are asked about; "": its only one.

    Raises:
        EndpointError: The policy remembers from tick to tick, or has several groups and none is named.
    """

    def __init__(self, policy: TrainedPolicy, member: str = "") -> None:
        self.policy = policy
        self.spec, self._decider = _decider_of(policy, member)
        self._queue: BatchingQueue[Question, Answer] = BatchingQueue(self._decide)
        self._service = HttpService(self._route)
        self.requests = self.refused = 0
        self.latencies_ms: deque[float] = deque(maxlen=LATENCIES_KEPT)

    @property
    def batches(self) -> int:
        """How many forward passes there were."""
        return self._queue.batches

    async def listen(self, host: str, port: int) -> int:
        """Begin to listen; return the port. Raises OSError."""
        return await self._service.listen(host, port)

    async def close(self) -> None:
        """Stop."""
        await self._service.close()
        self._queue.close()

    def p99_ms(self) -> float:
        """Return how long 99 of 100 answers took at most, in this process, ms; 0 before the first."""
        return float(np.percentile(self.latencies_ms, 99)) if self.latencies_ms else 0.0

    def warm_up(self) -> None:
        """Decide once on nothing, so that the first to ask does not wait for it."""
        nothing = {name: np.zeros((1, *part.shape), part.dtype) for name, part in self.spec.visible.items()}
        self._decide([Question(nothing, None, "instances")])

    async def _route(self, request: Request) -> Reply:
        if request.path == "/ping":
            return Reply(b"{}")
        if request.path == "/" and request.method == "GET":
            return Reply(json.dumps({"run": str(self.policy.run.path), **signature(self.spec)}).encode())
        if request.path != "/invocations":
            raise HttpError(404, "not_found", f"there is no {request.path[:80]}; expected /ping or /invocations.")
        if request.method != "POST":
            raise HttpError(405, "method", f"{request.method} /invocations; expected POST.")
        try:
            question = read_question(request, self.spec)
        except HttpError:
            self.refused += 1
            raise
        try:
            answer = await self._queue.ask(question, request.arrived + SECONDS_FOR_AN_ANSWER)
        except TimeoutError:
            raise HttpError(503, "too_slow", "the policy did not answer in time; try again.") from None
        reply = write_answer(answer, question, request.headers.get("accept", ""))
        self.requests += 1
        self.latencies_ms.append((time.monotonic() - request.arrived) * 1000)
        return reply

    def _decide(self, questions: list[Question]) -> Sequence[Answer]:
        """Decide for everybody who waits; those with a mask and those without by themselves."""
        answers: list[Answer | None] = [None] * len(questions)
        for masked in (False, True):
            asked = [at for at, one in enumerate(questions) if (one.action_mask is not None) is masked]
            groups = [asked] if not masked else _by_width(questions, asked)
            for group in groups:
                if group:
                    for at, answer in zip(group, self._decide_alike([questions[at] for at in group]), strict=True):
                        answers[at] = answer
        return answers  # type: ignore[return-value]

    def _decide_alike(self, questions: list[Question]) -> list[Answer]:
        seen = {name: np.concatenate([one.observations[name] for one in questions]) for name in self.spec.visible}
        masks = [one.action_mask for one in questions if one.action_mask is not None]
        mask = np.concatenate(masks) if masks else None
        likely = self._probabilities(seen, mask)
        # The likeliest choice is the greedy action, so a policy with probabilities is asked once.
        actions = self._decider.act(seen, mask) if likely is None else likely.argmax(axis=1)
        ends = np.cumsum([one.rows for one in questions])[:-1]
        likelies = [None] * len(questions) if likely is None else np.split(likely, ends)
        return [Answer(part, odds) for part, odds in zip(np.split(actions, ends), likelies, strict=True)]

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


def _by_width(questions: list[Question], asked: list[int]) -> list[list[int]]:
    """Return groups of questions whose masks are equally wide."""
    groups: dict[int, list[int]] = {}
    for at in asked:
        mask = questions[at].action_mask
        assert mask is not None
        groups.setdefault(mask.shape[1], []).append(at)
    return list(groups.values())

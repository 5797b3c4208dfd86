"""A trained policy as a player: out of a run folder by itself, or that of a learner which learns on.

Begin with `load_policy`. It needs neither the world nor its settings: every checkpoint holds a `PolicySpec`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.algorithms.learner import Compilable, Learner, greedy_policy_of
from racecraft.algorithms.multi_policy import MultiPolicy, of_member
from racecraft.algorithms.policy_spec import MULTI_POLICY, PolicySpec
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.sampling import Sampler, sample_actions
from racecraft.algorithms.stacking import load_stacked
from racecraft.algorithms.weights import to_tensors
from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, ArraySpec
from racecraft.formats.checkpoint import BEST, CheckpointEntry, Checkpoints
from racecraft.formats.checkpoint_ranking import find_checkpoint, split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.players.custom_code_loader import own_code_of
from racecraft.players.open_run import open_run

if TYPE_CHECKING:
    from racecraft.algorithms.compiled_policy import CompiledPolicy

SPEC = "policy_spec"
"""Where a checkpoint's metadata holds the spec."""


class GreedyPolicy:
    """The likeliest action of a learner's policy, every time; sees nothing privileged.

    The learner may go on learning; the policy then follows it.
    """

    def __init__(self, learner: Learner) -> None:
        self._policy = greedy_policy_of(learner)

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Choose an action for every row (R, …)."""
        return self._policy.act(observations, action_mask)

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self._policy.reset_state(rows)

    def compile_policy(self, name: str, frame: tuple[int, ...]) -> CompiledPolicy | None:
        """Return the policy's; see `Compilable`."""
        return self._policy.compile_policy(name, frame) if isinstance(self._policy, Compilable) else None


@dataclass(frozen=True)
class TrainedPolicy:
    """The greedy policy of a checkpoint, and where it comes from. It is a `Policy`."""

    run: RunFolder
    checkpoint: CheckpointEntry
    spec: PolicySpec
    """What it sees and decides."""
    policy: Any
    """The algorithm's own policy; what more it offers (such as `probabilities`) hangs on the algorithm."""
    metadata: Mapping[str, Any]
    """All that the checkpoint says of itself, the training's settings among it."""

    def act(
        self, observations: Any, action_mask: Array | None = None, *, sample: np.random.Generator | None = None
    ) -> Array:
        """Choose an action for every row (R, …), or for one bare observation as an environment gives it.

        Args:
            observations: Arrays (R, …) by name; what the policy does not know is ignored. A bare observation: parts by
                name without rows, or the only part itself; of a one-hot part also the number that it stands for.
            action_mask: bool (R, A), or (A,) beside a bare observation.
            sample: Draw each action by its probability with this generator, instead of taking the most probable one.

        Returns:
            (R, *action shape); for a bare observation (*action shape).

        Raises:
            SettingError: One array for several parts, or a policy that draws nothing is to be sampled.
        """
        rows, is_bare = rows_of(observations, self.spec.observations)
        if is_bare and action_mask is not None:
            action_mask = np.asarray(action_mask)[None]
        chosen: Array = (
            self.policy.act(rows, action_mask) if sample is None else self._sampled(rows, action_mask, sample)
        )
        return chosen[0] if is_bare else chosen

    def _sampled(self, rows: Mapping[str, Array], action_mask: Array | None, sample: np.random.Generator) -> Array:
        if not isinstance(self.policy, Sampler):
            raise SettingError(
                "a policy of {algorithm} knows no probabilities; expected one that draws its actions. Leave out "
                "`sample`: it then gives the action that it holds best.",
                algorithm=self.spec.algorithm,
            )
        return sample_actions(self.policy, rows, action_mask, sample)

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows (bool, (R,)) whose episode ended."""
        self.policy.reset_state(rows)

    def compile_policy(self, name: str, frame: tuple[int, ...]) -> CompiledPolicy | None:
        """Return the policy's; see `Compilable`."""
        return self.policy.compile_policy(name, frame) if isinstance(self.policy, Compilable) else None

    def probabilities(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return how likely each choice is, float32 (R, A); of policies over single choices."""
        likely: Array = self.policy.probabilities(observations, action_mask)
        return likely


def rows_of(observations: Any, parts: Mapping[str, ArraySpec]) -> tuple[Mapping[str, Array], bool]:
    """Return observations with rows, and whether they are of one bare observation; what is neither is returned as is.

    Raises:
        SettingError: One array is given, and the policy sees several.
    """
    if not isinstance(observations, Mapping):
        if len(parts) != 1:
            raise SettingError(
                "one array was given, and the policy sees {names}; expected each by its name.", names=", ".join(parts)
            )
        observations = {next(iter(parts)): observations}
    elif all(np.ndim(observations.get(name, 0)) == len(part.shape) + 1 for name, part in parts.items()):
        return observations, False
    rows = {}
    for name, part in parts.items():
        if name not in observations:
            return observations, False
        value = np.asarray(observations[name])
        if value.ndim > len(part.shape):
            return observations, False
        if value.shape == () and value.dtype.kind in "iu" and part.shape != (1,) and len(part.shape) == 1:
            value = np.eye(part.shape[0])[int(value)]
        rows[name] = value.reshape(1, *part.shape).astype(part.dtype)
    return rows, bool(parts)


def load_policy(run: str | Path | RunFolder, which: str = "") -> TrainedPolicy:
    """Return the policy of a run folder, or of a model that AWS's trainer made.

    Where its network or its algorithm is the user's own, the copy of it in the run is run.

    Args:
        run: The folder; RUN:best, RUN:last and RUN:N name a checkpoint. A model: an archive, folder, graph, checkpoint.
        which: "best", "last", an iteration's number or a merit such as "laptime"; "": what `run` says, else best.

    Raises:
        RunFolderError: There is no run folder, or its checkpoint holds no policy spec.
        CheckpointError: No such checkpoint, or a damaged one.
        PolicySpecError: A newer racecraft wrote it.
        SettingError: Its algorithm is a user's own and is not found here.
    """
    folder, named = (run, BEST) if isinstance(run, RunFolder) else _opened(str(run))
    checkpoint = find_checkpoint(folder, which or named)
    weights, metadata = Checkpoints(folder.checkpoints).load_policy(str(checkpoint.iteration))
    spec = spec_in(folder, metadata)
    with own_code_of(folder):
        policy = policy_from(spec, to_tensors(weights))
    return TrainedPolicy(folder, checkpoint, spec, policy, metadata)


def spec_in(run: RunFolder, metadata: Mapping[str, Any]) -> PolicySpec:
    """Return the spec of a checkpoint.

    Raises:
        PolicySpecError: A newer racecraft wrote it.
        RunFolderError: It holds none.
    """
    if SPEC not in metadata:
        raise RunFolderError(
            "{path}: its checkpoint says neither what the policy sees nor what it decides; expected a policy "
            "spec. It was not written by racecraft, or is damaged.",
            path=run.path,
        )
    return PolicySpec.from_dictionary(metadata[SPEC])


def policy_from(spec: PolicySpec, weights: Mapping[str, Any]) -> Policy:
    """Return the greedy policy that a spec and its weights (tensors by name) describe."""
    if spec.algorithm == MULTI_POLICY:
        members = {name: policy_from(part, of_member(weights, name)) for name, part in spec.policies.items()}
        return MultiPolicy(spec, members)
    if spec.stack_size > 1:
        return load_stacked(spec, lambda inner: policy_from(inner, weights))
    policy: Policy = find_algorithm(spec.algorithm).learner_class().load_policy(spec, weights)
    return policy


def _opened(run: str) -> tuple[RunFolder, str]:
    path, which = split_source(run)
    return open_run(path), which

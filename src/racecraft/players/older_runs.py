"""Runs from before checkpoints held a `PolicySpec`: the spec told from the run's kind and settings.

Every such run was trained by PPO; its checkpoint's metadata holds the settings and what the world was.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from racecraft.algorithms.networks import NetworkConfig, architecture_of
from racecraft.algorithms.policy_spec import MULTI_POLICY, PolicySpec, architecture_values, spec_of_policy
from racecraft.contract.errors import RunFolderError
from racecraft.contract.world import WorldSpec
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import from_dictionary

Metadata = Mapping[str, Any]


def older_spec(run: RunFolder, metadata: Metadata) -> PolicySpec:
    """Return the spec of an older run's checkpoint.

    Raises:
        RunFolderError: It is of a kind that older runs did not have.
    """
    tellers: Mapping[str, Callable[[Metadata], PolicySpec]] = {
        "deepracer": _of_car,
        "battlesnake": _of_snake,
        "gymnasium": _of_gymnasium,
        "unity": _of_unity,
    }
    kind = metadata.get("kind", run.read_job().get("kind"))
    if kind not in tellers:
        raise RunFolderError(
            f"{run.path}: its checkpoint says neither what the policy sees nor what it decides; expected a policy "
            "spec. It was not written by racecraft, or is damaged."
        )
    if kind == "unity":
        refuse_older_heads(run.path, metadata, None)
    return tellers[kind](metadata)


def refuse_older_heads(path: Any, metadata: Metadata, spec: PolicySpec | None) -> None:
    """Refuse a run of a Unity scene whose policy decides otherwise than its agents are told today.

    Once several branches were one choice among all their combinations, and numbers and branches at once were scores.

    Args:
        path: The run's folder, for the letter.
        metadata: What its checkpoint says of itself.
        spec: Its policy spec; None where it has none yet.

    Raises:
        RunFolderError: It is such a run.
    """
    from racecraft.contract.world import ContinuousActions, DiscreteActions
    from racecraft.worlds.unity.env.actions import ActionTable
    from racecraft.worlds.unity.env.cards import behaviors_in

    for base, (behavior, _) in behaviors_in(metadata).items():
        today = ActionTable(behavior.actions).spec
        then = None if spec is None else spec.policies.get(base, spec).actions
        if today == then or (then is None and isinstance(today, DiscreteActions | ContinuousActions)):
            continue
        raise RunFolderError(
            f"{path}: the policy of '{base}' was trained by an older racecraft, where several branches were one choice "
            "among all their combinations, or scores beside the numbers; expected a choice for each of its branches "
            f"{behavior.actions.branches}. What it learned cannot be carried over: train afresh, without --from and "
            "--resume."
        )


def _spec(spec: WorldSpec, settings: Metadata) -> PolicySpec:
    told = from_dictionary(Settings(network=NetworkConfig()), settings)
    network = architecture_values(architecture_of(told.network))
    floor = settings.get("ppo", {}).get("probability_floor", 0.0)
    return spec_of_policy(spec, "ppo", {**network, "probability_floor": floor})


def _of_car(metadata: Metadata) -> PolicySpec:
    from racecraft.worlds.deepracer.env.promise import world_spec
    from racecraft.worlds.deepracer.env.settings import CameraConfig
    from racecraft.worlds.deepracer.players.trained_car import actions_of

    settings = metadata["settings"]
    return _spec(world_spec(actions_of(metadata["model_metadata"]), CameraConfig(**settings["camera"])), settings)


def _of_snake(metadata: Metadata) -> PolicySpec:
    from racecraft.contract.world import DiscreteActions
    from racecraft.worlds.battlesnake.env.board import MOVES
    from racecraft.worlds.battlesnake.env.observation import observation_specs

    settings = metadata["settings"]
    seen = observation_specs(settings["selfplay"]["view"], settings["selfplay"]["outlook"])
    return _spec(WorldSpec("battlesnake", 1, 1, seen, DiscreteActions(4, MOVES), has_action_mask=True), settings)


def _of_gymnasium(metadata: Metadata) -> PolicySpec:
    from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld

    world = GymnasiumWorld(metadata["environment"], 1)
    try:
        return _spec(world.spec, metadata["settings"])
    finally:
        world.close()


def _of_unity(metadata: Metadata) -> PolicySpec:
    from racecraft.worlds.unity.env.cards import behaviors_in
    from racecraft.worlds.unity.env.several import joint_spec
    from racecraft.worlds.unity.env.world import spec_of

    shared = metadata["settings"]
    parts = {
        base: (spec_of(behavior, base), {**shared, **own}) for base, (behavior, own) in behaviors_in(metadata).items()
    }
    if len(parts) == 1:
        return _spec(*next(iter(parts.values())))
    together = joint_spec({base: spec for base, (spec, _) in parts.items()}, "unity")
    return PolicySpec(
        MULTI_POLICY,
        together.observations,
        together.actions,
        has_action_mask=together.has_action_mask,
        policies={base: _spec(spec, settings) for base, (spec, settings) in parts.items()},
    )

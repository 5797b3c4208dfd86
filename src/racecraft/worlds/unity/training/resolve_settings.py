"""What only the scene could tell of a Unity training: how many agents learn, and what they see.

Begin with `resolve`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.algorithms.building import IMITATION, SIGNALS
from racecraft.algorithms.registry import Algorithm
from racecraft.contract.errors import RunFolderError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import spec_in
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import apply_overrides, as_dictionary, from_dictionary, with_values
from racecraft.training.named_files import as_in_run, found_in_run
from racecraft.worlds.unity.env.behavior_specs import behaviors_in
from racecraft.worlds.unity.env.behaviors import Behavior, card_of
from racecraft.worlds.unity.files.trainer_config import PPO, SAC, BehaviorConfig
from racecraft.worlds.unity.training.plan import WORLD_SETTINGS, UnityPlan, defaults_for

SMALL_CONVOLUTIONS: dict[str, tuple[int, ...]] = {
    "conv_filters": (16, 32),
    "conv_kernels": (3, 3),
    "conv_strides": (1, 1),
}
"""For pictures that are too small for the usual ones."""


@dataclass(frozen=True)
class ResolvedSettings:
    """The settings of a training, the scene heard."""

    each: Mapping[str, Settings]
    """Of every behavior that learns, by its name without the team: networks and learners may differ."""
    notes: tuple[str, ...]
    """What is worth saying before the first tick, a clause each."""
    max_steps: int | None = None
    """Where the configuration ends the training; of several behaviors added up."""

    @property
    def shared(self) -> Settings:
        """What all go by: rollout, evaluation, runtime (and the network and learner of the first)."""
        return next(iter(self.each.values()))


def own_groups(settled: ResolvedSettings, algorithm: Algorithm) -> dict[str, dict[str, dict[str, Any]]]:
    """Return the groups of settings that each behavior has for itself, as plain values."""
    own = ("network", algorithm.group, *SIGNALS, IMITATION)
    by_name = {
        base: as_dictionary(as_in_run(settings, of=whose(number, base)))
        for number, (base, settings) in enumerate(settled.each.items())
    }
    return {base: {name: groups[name] for name in own if name in groups} for base, groups in by_name.items()}


def resolve(plan: UnityPlan, behaviors: Sequence[Behavior], rows_of: Mapping[str, slice]) -> ResolvedSettings:
    """Settle what only the scene could tell.

    The defaults come first, then what the scene needs, then the configuration, then what was typed.

    Args:
        plan: What was asked.
        behaviors: Who learns.
        rows_of: Which rows are whose, by name without the team.

    Raises:
        RunFolderError: A resumed run's scene has changed.
    """
    agents = {base: rows.stop - rows.start for base, rows in rows_of.items()}
    rows = sum(agents.values())
    if plan.resumed_run is not None:
        return ResolvedSettings(_settings_of_started(plan, plan.resumed_run, behaviors, rows), plan.notes)
    notes = [*plan.config.notes, *plan.notes, *_notes_on(plan, behaviors, rows)]
    each = {}
    for behavior in behaviors:
        each[behavior.base_name], more = _settings_for(plan, behavior, agents[behavior.base_name])
        notes += more
    horizon = max(settings.rollout.horizon for settings in each.values())
    if len({settings.rollout.horizon for settings in each.values()}) > 1:
        notes.append(f"buffers of the behaviors differ; they are filled together, {horizon} ticks at a time")
    together = {"num_worlds": rows, "horizon": horizon}
    limits = [limit for behavior in behaviors if (limit := plan.config.behavior(behavior.name).max_steps)]
    return ResolvedSettings(
        {base: with_values(settings, "rollout", together) for base, settings in each.items()},
        tuple(dict.fromkeys(notes)),
        sum(limits) or None,
    )


def _notes_on(plan: UnityPlan, behaviors: Sequence[Behavior], rows: int) -> list[str]:
    notes, configured = [], set(plan.config.behaviors)
    for behavior in behaviors:
        if configured and not {behavior.name, behavior.base_name, "*"} & configured:
            only = ", ".join(plan.config.behaviors)
            notes.append(f"the configuration says nothing of '{behavior.base_name}', only of {only}")
    if len(behaviors) > 1:
        names = ", ".join(behavior.base_name for behavior in behaviors)
        notes.append(f"{names} learn side by side, each from its own agents; --behavior chooses one")
    if plan.settings.rollout.num_worlds not in (rows, WORLD_SETTINGS.rollout.num_worlds):
        notes.append(f"rollout.num_worlds is {rows}: the scene has so many agents")
    return notes


def _settings_for(plan: UnityPlan, behavior: Behavior, agents: int) -> tuple[Settings, tuple[str, ...]]:
    defaults, notes = _with_fitting_convolutions(behavior, defaults_for(plan.build_name, plan.algorithm))
    section = plan.config.behavior(behavior.name)
    overrides = _overrides_of(section, plan.algorithm, agents)
    notes = (*notes, *_notes_on_trainer(section, plan.algorithm, section in plan.config.behaviors.values()))
    if plan.config.device is not None:
        overrides = (*overrides, f"runtime.device={plan.config.device}")
    return apply_overrides(defaults, (*overrides, *plan.request.overrides)), notes


def _overrides_of(section: BehaviorConfig, algorithm: Algorithm, agents: int) -> tuple[str, ...]:
    """Return what a section of the configuration sets of an algorithm; of one that ML-Agents has not, the network."""
    if algorithm.name in (PPO, SAC):
        return section.overrides(agents, algorithm.name)
    return tuple(override for override in section.overrides(agents, SAC) if override.startswith("network."))


def _notes_on_trainer(section: BehaviorConfig, algorithm: Algorithm, is_configured: bool) -> list[str]:
    """Return what a section says and this algorithm does not follow, a clause each."""
    at, name, notes = f"behaviors.{section.name}", algorithm.name, []
    if name == PPO or not is_configured:
        return []
    if section.normalize:
        notes.append(f"{at}.network_settings.normalize: {name} reads vectors as they are")
    if section.memory_size is not None:
        notes.append(f"{at}.network_settings.memory: {name} has none")
    notes += [f"{at}.reward_signals.{signal}: {name} has no such signal" for signal in section.signals]
    if section.cloning:
        notes.append(f"{at}.behavioral_cloning: {name} imitates nothing")
    if name != section.trainer:
        whose = "the network, batch_size, learning_rate and gamma are" if name == SAC else "the network is"
        notes.append(f"{at}.trainer_type: '{section.trainer}', and {name} learns; of this section {whose} followed")
    return notes


def _with_fitting_convolutions(behavior: Behavior, settings: Settings) -> tuple[Settings, tuple[str, ...]]:
    """Return the settings with convolutions that find room in the smallest picture, and what is worth saying."""
    sides = [min(sensor.shape[:2]) for sensor in behavior.sensors if sensor.is_picture]
    network = settings.network
    if not sides or _fits(min(sides), network.conv_kernels, network.conv_strides):
        return settings, ()
    small = SMALL_CONVOLUTIONS
    if not _fits(min(sides), small["conv_kernels"], small["conv_strides"]):
        small = dict.fromkeys(small, ())
    kernels = ", ".join(f"{kernel} x {kernel}" for kernel in small["conv_kernels"]) or "none"
    note = f"a picture is only {min(sides)} px wide or high: convolutions are {kernels} (network.conv_kernels)"
    return with_values(settings, "network", small), (note,)


def _fits(side: int, kernels: tuple[int, ...], strides: tuple[int, ...]) -> bool:
    for kernel, stride in zip(kernels, strides, strict=True):
        if side < kernel:
            return False
        side = (side - kernel) // stride + 1
    return True


def _settings_of_started(
    plan: UnityPlan, run: RunFolder, behaviors: Sequence[Behavior], rows: int
) -> dict[str, Settings]:
    """Return the settings that a run was begun with, of each behavior, if the scene is still what it was."""
    _, metadata = Checkpoints(run.checkpoints).load_policy("last")
    spec_in(run, metadata)  # refuses actions of an older kind
    then = behaviors_in(metadata)
    if list(then) != [behavior.base_name for behavior in behaviors]:
        here = ", ".join(behavior.base_name for behavior in behaviors)
        raise RunFolderError(
            "{path}: was begun with the behaviors {then}; the scene has {here} now. Give back the "
            "build, or begin a new run.",
            path=run.path,
            then=", ".join(then),
            here=here,
        )
    for behavior in behaviors:
        before, now = card_of(then[behavior.base_name][0]), card_of(behavior)
        for name in ("name", "sensors", "actions"):
            if before[name] != now[name]:
                raise RunFolderError(
                    "{path}: the scene has changed since the run began; of '{base_name}' its {name} "
                    "was {before} and is {now}. Give back the build, or begin a new run.",
                    path=run.path,
                    base_name=behavior.base_name,
                    name=name,
                    before=before[name],
                    now=now[name],
                )
    if rows != plan.settings.rollout.num_worlds:
        raise RunFolderError(
            "{path}: was begun with {num_worlds} agents and the scene has {rows} now; "
            "expected as many. Give back the build, or begin a new run with --from.",
            path=run.path,
            num_worlds=plan.settings.rollout.num_worlds,
            rows=rows,
        )
    each = {base: from_dictionary(plan.settings, own) for base, (_, own) in then.items()}
    return {
        base: found_in_run(settings, run, of=whose(number, base))
        for number, (base, settings) in enumerate(each.items())
    }


def whose(number: int, base: str) -> str:
    """Return the name that a behavior's files bear in a run; of the first none: they are the training's own."""
    return file_name(base) if number else ""


def file_name(behavior: str) -> str:
    """Return a behavior's name as part of a file's."""
    return "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in behavior)

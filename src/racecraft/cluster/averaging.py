"""A training whose workers find the gradients, each in what it collected. Begin with `with_averaging`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from racecraft.algorithms.building import IMITATION, SIGNALS, build_learner
from racecraft.algorithms.learner import Learner
from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.sharded_ppo import AveragingPpo, Drawn, Found
from racecraft.contract.errors import SettingError
from racecraft.contract.world import WorldSpec
from racecraft.training.trainer import Experiment

LEARNS = "ppo"
SETTING = "cluster.gradients is workers"
LEAVE = "or leave cluster.gradients at learner."


def averages(experiment: Experiment) -> bool:
    """Tell whether workers are asked to find the gradients."""
    return "cluster" in experiment.settings and experiment.settings.cluster.gradients == "workers"


def with_averaging(
    experiment: Experiment, spec: WorldSpec, find: Callable[[Drawn], Sequence[Found]]
) -> Callable[[], Learner]:
    """Return what makes the experiment's learner, with gradients that others find.

    Args:
        experiment: Its settings passed `require_averaging`.
        spec: What the worlds of all workers promise together.
        find: Asks every worker about a minibatch.
    """

    def made() -> Learner:
        built = experiment.learner or (
            lambda: build_learner(experiment.algorithm, spec, experiment.settings, experiment.seed)
        )
        inner = built()
        assert isinstance(inner, PpoLearner), "others are refused before"
        return AveragingPpo(inner, find)

    return made


def require_averaging(experiment: Experiment) -> None:
    """Refuse what gradients of workers cannot teach.

    Raises:
        SettingError: The algorithm, or what is laid round it, needs all rows in one place.
    """
    algorithm, settings = experiment.algorithm, experiment.settings
    if algorithm.name != LEARNS:
        raise SettingError(f"{SETTING}, and {algorithm.name} finds its own; expected --algorithm {LEARNS}, {LEAVE}")
    if experiment.world.spec.groups:
        raise SettingError(
            f"{SETTING}, and agents of several kinds have a learner each, side by side; expected one policy, {LEAVE}"
        )
    for name, why in _obstacles(experiment).items():
        group, _, part = name.partition(".")
        value = getattr(getattr(settings, group), part)
        raise SettingError(f"{SETTING} and {name} {value}, {why}; expected it left out, {LEAVE}")


def require_rows(experiment: Experiment, workers: int) -> None:
    """Refuse minibatches with fewer rows than there are workers.

    Raises:
        SettingError: Somebody would have nothing to do in each of them.
    """
    size = experiment.settings.ppo.batch_size
    if size < workers:
        raise SettingError(
            f"{SETTING}, {workers} of them, and ppo.batch_size is {size}; expected a row for each of them and better "
            f"hundreds. Give a larger batch, or fewer workers (--cluster {size})."
        )


def _obstacles(experiment: Experiment) -> dict[str, str]:
    """Return settings that stand in the way, each with why."""
    settings = experiment.settings
    network = settings.network
    standing = {
        "ppo.asynchronous": (settings.ppo.asynchronous, "which learns while workers collect"),
        "network.memory": (network.memory != "none", "which learns from stretches of ticks and not from rows"),
        "network.stack_size": (network.stack_size > 1, "which lays frames on one another where all of them are"),
        "network.normalise": (network.normalise, "whose statistics are of all that was seen"),
        "cluster.send": (settings.cluster.send != "frames", "where nothing that was seen need travel at all"),
    }
    bonuses = {
        f"{name}.strength": (getattr(settings, name).strength > 0, "which learns from all that was seen")
        for name in (*SIGNALS, IMITATION)
        if name in settings
    }
    return {name: why for name, (stands, why) in {**standing, **bonuses}.items() if stands}

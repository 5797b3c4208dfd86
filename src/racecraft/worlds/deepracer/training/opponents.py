"""Whom a training races against, made definite: models, and the world with all of them. See `against_world`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from racecraft.algorithms.building import build_learner
from racecraft.algorithms.weights import to_arrays
from racecraft.contract.errors import SettingError
from racecraft.training.opponent_pool import OpponentPool
from racecraft.training.processor import prepare_processor
from racecraft.training.trainer import weights_to_begin_with
from racecraft.worlds.deepracer.env.camera import mount_for_version
from racecraft.worlds.deepracer.env.reward_caller import CarRewards
from racecraft.worlds.deepracer.env.settings import HEAD_TO_MODEL
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.players.driver import Driver, league_in, load_driver
from racecraft.worlds.deepracer.players.run_track import KIND
from racecraft.worlds.deepracer.training.opponent_world import OpponentWorld, deal, own_actions
from racecraft.worlds.deepracer.training.plan import ITSELF, CarPlan
from racecraft.worlds.deepracer.training.weight_transfer import fit_critic, require_same_shape


def models_among(against: Sequence[str]) -> list[Driver]:
    """Return the chosen models among the words of --against; a folder of runs stands for all of them.

    Raises:
        UserInputError: One of them cannot be used.
    """
    return [load_driver(source) for source in league_in(one for one in against if one != ITSELF)]


def against_world(planned: CarPlan, reward: Callable[[int], CarRewards]) -> tuple[OpponentWorld, OpponentPool | None]:
    """Return the races that are learned in, and the pool of past selves where they are met there.

    Args:
        planned: The training; `race.type` is HEAD_TO_MODEL.
        reward: Makes the reward functions of so many cars.

    Raises:
        UserInputError: A chosen model cannot be used, or the weights to begin with do not fit.
    """
    settings, config = planned.settings, planned.settings.against
    chosen, itself = models_among(planned.against), ITSELF in planned.against
    races = settings.rollout.num_worlds
    dealt = deal(races, config, len(chosen), itself)
    learner = as_driver(planned)
    inner = RaceWorld(
        planned.track,
        own_actions(planned.actions, chosen, dealt),
        reward(races * config.cars),
        race_config=settings.race,
        camera_config=settings.camera,
        num_cars=races,
        start_shares=(settings.race.start_offset + np.arange(races) / races) % 1.0,
        mount=learner.mount,
        sensors=planned.sensors,
        cars_per_world=config.cars,
        start_ahead=config.start_ahead,
        variation=settings.variation,
    )
    world = OpponentWorld(inner, learner, dealt, chosen)
    if not itself:
        return world, None
    pool = _pool(planned, world)
    world.meet(pool)
    return world, pool


def as_driver(planned: CarPlan) -> Driver:
    """Return what the learner's own car sees and can be told."""
    mount = mount_for_version(planned.model.metadata.version)
    settings = planned.settings
    return Driver(
        "the learner", _Learner(), planned.actions, settings.race.car, settings.camera, mount, planned.sensors
    )


def require_racing(planned: CarPlan) -> None:
    """Refuse what cannot be trained in a race against others.

    Raises:
        SettingError: The message says what.
    """
    if planned.settings.race.type != HEAD_TO_MODEL:
        return
    if planned.courses:
        raise SettingError(
            "the cars of this training are shared out among several courses (worker-N.env, or both directions), and "
            "they race each other; expected one course. Leave --against out, or drive on one course."
        )
    network = planned.settings.network
    if network.memory != "none" or network.stack_size > 1:
        raise SettingError(
            "network.memory or network.stack_size is set, and past selves are exchanged while they drive; expected a "
            "network that decides by what it sees. Leave them at none and 1 where cars race each other."
        )


def _pool(planned: CarPlan, world: OpponentWorld) -> OpponentPool:
    """Return a pool that holds the self that the training begins with.

    Raises:
        UserInputError: The weights to begin with do not fit.
    """
    config, runtime = planned.settings.against, planned.settings.runtime
    prepare_processor(runtime.threads, runtime.device)  # first weights are the learner's to the bit by as many threads
    learner = build_learner(planned.algorithm, world.spec, planned.settings, planned.seed)
    first = to_arrays(learner.state_dict())["network"]
    if planned.request.clone_from is not None:
        first, _ = weights_to_begin_with(
            planned.request.clone_from,
            first,
            KIND,
            lambda path, metadata: require_same_shape(planned, path, metadata),
            fit_critic,
        )
    return OpponentPool(learner.policy_spec, first, config.pool_size, config.pool_every, planned.seed)


class _Learner:
    """Stands for the learner, who is asked elsewhere."""

    def act(self, observations: Any, action_mask: Any = None) -> Any:
        raise AssertionError("the learner decides in the collector")

    def reset_state(self, rows: Any) -> None:
        """Nothing is known."""

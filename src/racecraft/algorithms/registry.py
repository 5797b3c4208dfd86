"""Algorithms by name: the built-in ones, those of installed packages, and a user's own. Begin with `find_algorithm`.

A learner class names what the loop must know: `experience`, `figures`, `build`, `load_policy` (see `learner.py`). This
file holds what is known without importing the class: where it is, its group of settings, its kinds of actions.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.extensions import load_offered, offered
from racecraft.contract.loading import load_class
from racecraft.contract.world import (
    ActionSpec,
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    HybridActions,
    MultiDiscreteActions,
)
from racecraft.settings.composition import Settings

CHOICES, BRANCHES, NUMBERS, BOTH = "one choice", "several choices", "numbers", "numbers and choices"
"""Kinds of actions, in words."""
EVERYTHING = (CHOICES, BRANCHES, NUMBERS, BOTH)


def action_kinds_text(acts: Iterable[str]) -> str:
    """Return kinds of action for people: all of them are any."""
    return "any action" if set(acts) == set(EVERYTHING) else ", ".join(acts)


@dataclass(frozen=True)
class Variant:
    """A learner that takes the place of an algorithm's own where a setting asks for it."""

    group: str
    setting: str
    idle: Any
    """The setting's value that does not ask for it."""
    module: str
    learner: str
    """Name of the learner's class."""

    def is_selected(self, settings: Settings) -> bool:
        """Tell whether the settings ask for it."""
        return self.group in settings and getattr(getattr(settings, self.group), self.setting) != self.idle


@dataclass(frozen=True)
class Algorithm:
    """One way to improve."""

    name: str
    module: str
    learner: str
    """Name of the learner's class."""
    config: str
    """Name of its settings' class: the group's name and "Config"; "" where there are none."""
    title: str
    """One sentence for people."""
    label: str = ""
    """How lists call it; "": its name in capitals."""
    acts: tuple[str, ...] = EVERYTHING
    """Kinds of actions that it can learn."""
    replay: bool = False
    """Whether it learns from a replay, so that a training has the group of settings `replay`."""
    replay_values: Mapping[str, Any] = field(default_factory=dict, hash=False)
    """What that group has otherwise than by default."""
    reward_signals: bool = False
    """Whether it learns from rollouts that `curiosity`, `rnd` and `gail` may add to (`building.py`); it has their
    settings."""
    critic: bool = True
    """Whether it has a critic beside its policy, which `network.separate_networks` gives layers of its own."""
    several_groups: bool = False
    """Whether agents of several kinds may learn side by side, each with a policy of its own."""
    whole_episodes: bool = False
    """Whether it learns from whole episodes only (its learner's `experience` is EPISODES)."""
    stays: str = ""
    """Why its actors cannot be in other processes than its learner, a clause that its name begins; "": they can. They
    are given the group "network" of its weights."""
    searches: bool = False
    """Whether it learns from a search that the world brings along, so that such a training has the group `search`."""
    variants: tuple[Variant, ...] = ()
    """The first that the settings ask for learns in the place of `learner`."""
    own: Any = None
    """A user's own class; None: a built-in one, imported when it is asked for."""

    @property
    def group(self) -> str:
        """Name of its group of settings; "" where it has none."""
        return self.config.removesuffix("Config").casefold() if self.config else ""

    @property
    def action_kinds_text(self) -> str:
        """What it decides, in words for people."""
        return action_kinds_text(self.acts)

    def learner_class(self, settings: Settings | None = None) -> Any:
        """Return the learner's class, or that of the variant that the settings ask for."""
        if self.own is not None:
            return self.own
        matching = (one for one in self.variants if settings is not None and one.is_selected(settings))
        chosen = next(matching, self)
        return getattr(importlib.import_module(chosen.module), chosen.learner)

    def config_class(self) -> Any:
        """Return the class of its settings; None where it has none."""
        if self.own is not None:
            return getattr(self.own, "Config", None)
        return getattr(importlib.import_module(self.module), self.config)


ALGORITHMS: dict[str, Algorithm] = {
    one.name: one
    for one in (
        Algorithm(
            "ppo",
            "racecraft.algorithms.ppo",
            "PpoLearner",
            "PpoConfig",
            "Proximal policy optimisation: learns steadily from what the current policy does; the default.",
            several_groups=True,
            reward_signals=True,
            variants=(
                Variant("ppo", "asynchronous", False, "racecraft.algorithms.asynchronous_ppo", "AsynchronousPpo"),
                Variant("network", "memory", "none", "racecraft.algorithms.recurrent_ppo", "RecurrentPpoLearner"),
            ),
        ),
        Algorithm(
            "dqn",
            "racecraft.algorithms.dqn",
            "DqnLearner",
            "DqnConfig",
            "Deep Q-learning: learns what each choice is worth from all that it remembers; few steps, single choices.",
            acts=(CHOICES,),
            critic=False,
            replay=True,
        ),
        Algorithm(
            "apex",
            "racecraft.algorithms.apex",
            "ApexLearner",
            "ApexConfig",
            "Ape-X: DQN with many actors that explore unlike each other and a learner beside them; not bit by bit the "
            "same twice.",
            label="Ape-X",
            acts=(CHOICES,),
            critic=False,
            replay=True,
            replay_values={"prioritised": True},
        ),
        Algorithm(
            "sac",
            "racecraft.algorithms.sac",
            "SacLearner",
            "SacConfig",
            "Soft actor-critic: learns numbers from all it remembers, staying as undecided as it can afford.",
            acts=(NUMBERS,),
            replay=True,
        ),
        Algorithm(
            "reinforce",
            "racecraft.algorithms.reinforce",
            "ReinforceLearner",
            "ReinforceConfig",
            "The oldest policy gradient, from whole episodes: the one to read first.",
            whole_episodes=True,
            reward_signals=True,
        ),
        Algorithm(
            "es",
            "racecraft.algorithms.es",
            "EsLearner",
            "EsConfig",
            "Evolution strategies: a population of perturbed policies, no gradients through the network.",
            whole_episodes=True,
            stays="deals a member of its population to every row in one process",
        ),
        Algorithm(
            "alphazero",
            "racecraft.algorithms.alphazero",
            "AlphaZeroLearner",
            "AlphaZeroConfig",
            "Learning by search: the policy follows a search that asks it, the critic who won; for snakes, best begun "
            "from a run of ppo.",
            label="AlphaZero",
            acts=(CHOICES,),
            searches=True,
            stays="asks the search that the world of its own process brings along",
        ),
        Algorithm(
            "bc",
            "racecraft.algorithms.behaviour_cloning",
            "BcLearner",
            "BcConfig",
            "Behavioural cloning: learns to do what recorded episodes show; others go on from its weights.",
            stays="collects nothing: it learns from files",
        ),
    )
}
"""The built-in algorithms by name."""


def choices(*acts: str, searches: bool = False) -> list[tuple[str, str]]:
    """Return (name, label) of the built-in algorithms that collect what they learn from, for a list in a form.

    Args:
        acts: Kinds of actions of which it learns at least one; none: any.
        searches: Whether the world brings the search that some learn from.

    >>> choices(NUMBERS)
    [('ppo', 'PPO'), ('sac', 'SAC'), ('reinforce', 'REINFORCE')]
    """
    return [
        (one.name, one.label or one.name.upper())
        for one in ALGORITHMS.values()
        if (searches if one.searches else not one.stays) and (not acts or set(acts) & set(one.acts))
    ]


_registered: dict[str, Algorithm] = {}


def register_algorithm(name: str, learner: type) -> None:
    """Let a script's own learner class be found by a name.

    Args:
        name: How it is called from now on, in this process; a built-in name cannot be taken.
        learner: Its class; see `algorithm_of`.

    Raises:
        SettingError: The name is taken, or the class is of the wrong shape.
    """
    if name in ALGORITHMS:
        raise SettingError(
            "the algorithm '{name}' is built in; expected another name for {learner}.",
            name=name,
            learner=learner.__name__,
        )
    _registered[name] = algorithm_of(learner, name)


def find_algorithm(name: str) -> Algorithm:
    """Return an algorithm: a built-in name, a registered one, one of an installed package, or "module:Class".

    Raises:
        SettingError: There is no such algorithm, or the class is of the wrong shape.
    """
    if name in ALGORITHMS:
        return ALGORITHMS[name]
    if name in _registered:
        return _registered[name]
    if (learner := load_offered("algorithms", name)) is not None:
        return algorithm_of(learner, name)
    if ":" in name:
        return algorithm_of(load_class(name, "--algorithm"), name)
    known = [*ALGORITHMS, *_registered, *offered("algorithms")]
    raise SettingError(
        "There is no algorithm '{name}'. {hint} Your own is named as module:Class.",
        name=name,
        hint=nearest(name, known),
    )


def all_algorithms() -> list[Algorithm]:
    """Return the built-in algorithms, the registered ones and those of installed packages, each name once.

    Raises:
        SettingError: An installed package offers a class of the wrong shape.
    """
    others = [
        algorithm_of(load_offered("algorithms", name), name)
        for name in offered("algorithms")
        if name not in _registered
    ]
    return [*ALGORITHMS.values(), *_registered.values(), *(one for one in others if one.name not in ALGORITHMS)]


PROMISED = ("experience", "figures", "build", "load_policy", "act", "reset_state", "choose", "update", "state_dict")
"""What a learner class must have."""


def algorithm_of(learner: Any, name: str) -> Algorithm:
    """Return the entry of a user's own learner class; `Config` on the class is its group of settings, if it has one.

    Raises:
        SettingError: Something that a learner promises is missing.
    """
    missing = [part for part in PROMISED if not hasattr(learner, part)]
    if not isinstance(learner, type) or missing:
        called, lacks = getattr(learner, "__name__", learner), ", ".join(missing) or "being a class"
        raise SettingError(
            "algorithm {name}: {called} lacks {lacks}; "
            "expected a class as `racecraft.algorithms.learner.Learner` describes it.",
            name=name,
            called=called,
            lacks=lacks,
        )
    return Algorithm(
        name,
        learner.__module__,
        learner.__name__,
        f"{learner.__name__}Config" if hasattr(learner, "Config") else "",
        (learner.__doc__ or "").strip().split("\n")[0],
        acts=tuple(getattr(learner, "acts", EVERYTHING)),
        replay=getattr(learner, "experience", "") == "replay",
        whole_episodes=getattr(learner, "experience", "") == "episodes",
        reward_signals=getattr(learner, "experience", "") in ("rollout", "episodes"),
        own=learner,
    )


def kind_of(actions: ActionSpec) -> str:
    """Return a kind of action in words.

    >>> kind_of(DiscreteActions(3))
    'one choice'
    """
    kinds: Mapping[type, str] = {
        DiscreteActions: CHOICES,
        MultiDiscreteActions: BRANCHES,
        ContinuousActions: NUMBERS,
        HybridActions: BOTH,
    }
    return kinds.get(type(actions), BOTH)


def require_fit(algorithm: Algorithm, actions: ActionSpec, what: str, is_searched: bool = False) -> None:
    """Refuse an algorithm that cannot learn such actions, or would learn from a search that is not there.

    Args:
        algorithm: Who is to learn.
        actions: What it is to decide.
        what: The world, for the letter.
        is_searched: Whether the world brings a search along, or can.

    Raises:
        SettingError: The message says what it needs, and who could.
    """
    if isinstance(actions, GroupedActions):
        if not algorithm.several_groups:
            raise SettingError(
                "--algorithm {name} teaches one policy; {what} has agents of several kinds. Use ppo.",
                name=algorithm.name,
                what=what,
            )
        return
    kind = kind_of(actions)
    others = [one.name for one in ALGORITHMS.values() if kind in one.acts and (is_searched or not one.searches)]
    if algorithm.searches and not is_searched:
        raise SettingError(
            "--algorithm {name} learns from a search, and {what} brings none along; expected "
            "`racecraft snakes train`. Algorithms that fit: {others}.",
            name=algorithm.name,
            what=what,
            others=", ".join(others),
        )
    if kind not in algorithm.acts:
        raise SettingError(
            "--algorithm {name} decides {acts}; an action of {what} is {kind}. Algorithms that fit: {others}.",
            name=algorithm.name,
            acts=" or ".join(algorithm.acts),
            what=what,
            kind=kind,
            others=", ".join(others),
        )

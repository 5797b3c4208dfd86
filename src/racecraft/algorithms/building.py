"""From settings to a learner: the algorithm's own, and what is laid round it. Begin with `build_learner`.

network.stack_size  → stacking.py     sees the last k observations
curiosity, rnd      → intrinsic.py    is also rewarded for what it has not seen
gail                → intrinsic.py    is also rewarded for what passes for what was shown
imitation           → imitation.py    also does what was shown
evaluation.averaged → averaging.py    is judged and kept by the mean of its latest weights
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from racecraft.algorithms.registry import Algorithm
from racecraft.contract.errors import SettingError
from racecraft.contract.world import GroupedActions, WorldSpec
from racecraft.settings.composition import Settings

if TYPE_CHECKING:  # torch is imported when something is built, not by whoever asks for settings
    from racecraft.algorithms.intrinsic import RewardModel
    from racecraft.algorithms.learner import Learner
    from racecraft.algorithms.networks import NetworkConfig

SIGNALS = ("curiosity", "rnd", "gail")
"""Groups of settings that add to what is rewarded."""
IMITATION = "imitation"
"""The group of what is imitated beside."""
EVALUATION = "evaluation"
"""The group that says how a training is judged, and what of it is kept."""
OPTIONAL_NETWORK_SETTINGS = {"memory": "none", "normalise": False, "encoder": None, "policy": None}
"""Settings of `network` that only some learners support, with the value that asks for nothing."""
SEED_APART = 7_919
"""Between the seeds of what is built side by side."""


def build_learner(algorithm: Algorithm, spec: WorldSpec, settings: Settings, seed: int) -> Learner:
    """Return the learner that the settings describe.

    Args:
        algorithm: What learns.
        spec: The world's promise.
        settings: All groups of the training.
        seed: Of the first weights and of chance.

    Raises:
        SettingError: The algorithm cannot do what the settings ask for.
    """
    learner_class = algorithm.learner_class(settings)
    network = settings.network if "network" in settings else None
    if network is not None:
        _require_followed(algorithm, network, getattr(learner_class, "supported_network_settings", ()))

    def build(seen: WorldSpec) -> Learner:
        built: Learner = learner_class.build(seen, settings, seed)
        signalled = with_reward_signals(with_imitation(built, settings, seed), settings, seed)
        return with_averaging(signalled, algorithm, settings)

    if network is None or network.stack_size == 1:
        return build(spec)
    from racecraft.algorithms.stacking import StackedLearner

    return StackedLearner(spec, network.stack_size, build)


def _require_followed(algorithm: Algorithm, network: NetworkConfig, supported: tuple[str, ...]) -> None:
    for name, idle in OPTIONAL_NETWORK_SETTINGS.items():
        value = getattr(network, name)
        if value != idle and name not in supported:
            raise SettingError(
                "network.{name} is {value}, which {name_2} does not follow. Use ppo, or leave it at {idle}.",
                name=name,
                value=value,
                name_2=algorithm.name,
                idle=idle,
            )
    if network.separate_networks and not algorithm.critic:
        raise SettingError(
            "network.separate_networks is True, and {name} has no critic that could have layers of its own. "
            "Leave it at False.",
            name=algorithm.name,
        )
    _require_one_network(network)


def _require_one_network(network: NetworkConfig) -> None:
    """Refuse two networks for one place.

    Raises:
        SettingError: A network of the user's own, and something beside it that it takes the place of.
    """
    own = {"encoder": network.encoder, "policy": network.policy}
    beside = {"normalise": network.normalise, "memory": network.memory != "none"}
    given = [name for name, value in own.items() if value is not None]
    others = [*given[1:], *(name for name, value in beside.items() if value)]
    if given and others:
        raise SettingError(
            "network.{given} and network.{others} are both given; a network of your own takes the place of "
            "both. Leave one of them.",
            given=given[0],
            others=others[0],
        )
    if network.policy is not None and network.separate_networks:
        raise SettingError(
            "network.policy and network.separate_networks are both given; a network of your own has its own critic. "
            "Leave one of them."
        )


def with_imitation(learner: Learner, settings: Settings, seed: int) -> Learner:
    """Return the learner, also imitating what `imitation` names where it has a strength.

    Raises:
        SettingError: The learner cannot; demonstrations are missing, or of another world.
        CheckpointError: The file of demonstrations is none.
        DemonstrationError: A `.demo` file cannot be used.
    """
    config = getattr(settings, IMITATION) if IMITATION in settings else None
    if config is None or not config.strength:
        return learner
    from racecraft.algorithms.demonstrations import read_demonstration_batch
    from racecraft.algorithms.imitation import ImitationWrapper

    if config.demonstrations is None:
        raise SettingError(
            "imitation.strength is {strength:g} and no demonstrations are named; expected "
            "--set imitation.demonstrations=FILE, such as `racecraft record RUN` writes, or Unity's .demo files.",
            strength=config.strength,
        )
    return ImitationWrapper(
        learner, config, read_demonstration_batch(config.demonstrations), seed + (len(SIGNALS) + 1) * SEED_APART
    )


def with_reward_signals(learner: Learner, settings: Settings, seed: int) -> Learner:
    """Return the learner, rewarded also by each of `curiosity`, `rnd` and `gail` that the settings give a strength.

    Raises:
        SettingError: The learner does not learn from rollouts; demonstrations are missing, or of another world.
        CheckpointError: The file of demonstrations is none.
        DemonstrationError: A `.demo` file cannot be used.
    """
    for place, name in enumerate(SIGNALS):
        config = getattr(settings, name) if name in settings else None
        if config is not None and config.strength:
            from racecraft.algorithms.intrinsic import IntrinsicReward

            model = _reward_model(name, learner.spec, settings, seed + (place + 1) * SEED_APART)
            learner = IntrinsicReward(learner, model)
    return learner


def with_averaging(learner: Learner, algorithm: Algorithm, settings: Settings) -> Learner:
    """Return the learner, judged and kept by the mean of its latest weights where `evaluation.averaged` has a share.

    Raises:
        SettingError: The learner is asked by a search.
    """
    share = settings.evaluation.averaged if EVALUATION in settings else 0.0
    if not share:
        return learner
    if algorithm.searches:
        raise SettingError(
            "evaluation.averaged is {share:g}, and {name} is asked by a search, with its latest weights; expected 0.",
            share=share,
            name=algorithm.name,
        )
    from racecraft.algorithms.averaging import AveragedLearner

    return AveragedLearner(learner, share, algorithm.learner_class().load_policy)


def _reward_model(name: str, spec: WorldSpec, settings: Settings, seed: int) -> RewardModel:
    from racecraft.algorithms.networks import architecture_of

    assert not isinstance(spec.actions, GroupedActions), "agents of each kind have a learner of their own"
    architecture, device = architecture_of(settings.network), settings.runtime.device
    if name == "curiosity":
        from racecraft.algorithms.curiosity import CuriosityModel

        return CuriosityModel(spec.observations, spec.actions, architecture, settings.curiosity, seed, device)
    if name == "rnd":
        from racecraft.algorithms.rnd import RndModel

        return RndModel(spec.observations, architecture, settings.rnd, seed, device)
    from racecraft.algorithms.demonstrations import read_demonstration_batch
    from racecraft.algorithms.gail import GailModel

    if settings.gail.demonstrations is None:
        raise SettingError(
            "gail.strength is {strength:g} and no demonstrations are named; expected "
            "--set gail.demonstrations=FILE, such as `racecraft record RUN` writes, or Unity's .demo files.",
            strength=settings.gail.strength,
        )
    demonstrations = read_demonstration_batch(settings.gail.demonstrations)
    return GailModel(spec, spec.actions, architecture, settings.gail, demonstrations, seed, device)


def signal_groups() -> dict[str, Any]:
    """Return the groups of settings of the reward signals and of imitation, each at strength 0."""
    from racecraft.algorithms.curiosity import CuriosityConfig
    from racecraft.algorithms.gail import GailConfig
    from racecraft.algorithms.imitation import ImitationConfig
    from racecraft.algorithms.rnd import RndConfig

    return {"curiosity": CuriosityConfig(), "rnd": RndConfig(), "gail": GailConfig(), IMITATION: ImitationConfig()}

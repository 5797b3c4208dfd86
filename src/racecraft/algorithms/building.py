"""From settings to a learner: the algorithm's own, and what is laid round it. Begin with `build_learner`.

network.stack_size → stacking.py      sees the last k observations
curiosity, rnd     → intrinsic.py     is also rewarded for what it has not seen
"""

from __future__ import annotations

from racecraft.algorithms.learner import Learner
from racecraft.algorithms.registry import Algorithm
from racecraft.contract.errors import SettingError
from racecraft.contract.world import WorldSpec
from racecraft.settings.composition import Settings


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
    learner_class = algorithm.learner_class()
    network = settings.network if "network" in settings else None
    if network is not None and network.memory != "none" and not getattr(learner_class, "recurrent", False):
        raise SettingError(
            f"network.memory is {network.memory}; {algorithm.name} learns no policy with a memory. Use ppo, or leave "
            "it at none; network.stack_size shows the last observations to any policy that learns from rollouts."
        )

    def build(seen: WorldSpec) -> Learner:
        built: Learner = learner_class.build(seen, settings, seed)
        return built

    if network is None or network.stack_size == 1:
        return build(spec)
    from racecraft.algorithms.stacking import StackedLearner

    return StackedLearner(spec, network.stack_size, build)

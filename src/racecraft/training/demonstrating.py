"""Record what the policy of a run does, in the world that the run was trained in. Begin with `record_run`."""

from __future__ import annotations

from racecraft.contract.errors import SettingError
from racecraft.formats.demonstrations import Demonstrations
from racecraft.players.trained import load_policy
from racecraft.rollout.demonstrate import demonstrate
from racecraft.training.resume import MessageCallback
from racecraft.training.worlds import training_in


def record_run(
    run: str, episodes: int, *, seed: int = 0, sampled: bool = False, on_message: MessageCallback = lambda text: None
) -> Demonstrations:
    """Return so many episodes of a run's policy, of any kind of world.

    Args:
        run: The folder; RUN:best, RUN:last and RUN:N name a checkpoint.
        episodes: Whole episodes.
        seed: Of the world and of draws.
        sampled: Draw actions by the policy's probabilities instead of the likeliest.
        on_message: Called with a line for a person.

    Raises:
        RunFolderError: There is no run folder.
        CheckpointError: No such checkpoint, or a damaged one.
        SettingError: The policy has no probabilities to draw by, or is several policies.
    """
    policy = load_policy(run)
    if policy.spec.policies:
        raise SettingError(
            "{run} holds {count} policies, one for each group of agents; expected a run of one.",
            run=run,
            count=len(policy.spec.policies),
        )
    kind = policy.run.read_job()["kind"]
    module = training_in(kind)
    with module.build_experiment(module.plan_resume(policy.run.path, ()), on_message) as experiment:
        source = {
            "run": str(policy.run.path),
            "iteration": policy.checkpoint.iteration,
            "algorithm": policy.spec.algorithm,
            "kind": kind,
            "title": experiment.title,
            "sampled": sampled,
        }
        return demonstrate(policy.policy, experiment.world, episodes, seed=seed, sampled=sampled, source=source)

"""The racer's own expectations of a reward, run before a training. Begin with `require_expectations`."""

from __future__ import annotations

from racecraft.contract.errors import RewardError
from racecraft.worlds.deepracer.driving.reward.cases import CASES, run_cases
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.env.reward_process import RewardProcess


def require_expectations(reward: RewardProcess) -> None:
    """Run the cases beside a reward function, where there are any.

    Raises:
        InputFileError: The file of cases cannot be used.
        RewardError: A case does not hold.
    """
    path = reward.path.with_name(CASES)
    if not path.is_file():
        return
    results = run_cases(path, Payer(reward))
    failed = [result for result in results if not result.passed]
    if failed:
        raise RewardError(
            "{path}: {failed} of {count} cases do not hold; expected all of them. Mend the reward or the case."
            "\n{cases}",
            path=path,
            failed=len(failed),
            count=len(results),
            cases="\n".join(f"  {result.case.name}: {result.text}" for result in failed),
        )

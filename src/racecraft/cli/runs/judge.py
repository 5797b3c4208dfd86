"""`racecraft evaluate`, of any run. A world may bring a command of that name that knows more."""

from __future__ import annotations

from racecraft.actions.figures import Figures
from racecraft.actions.judging import evaluate_episodes
from racecraft.cli.from_request import command


def show_episodes(facts: Figures) -> None:
    """Print what the episodes of a run came to."""
    place = f"{facts['run']}, checkpoint {facts['checkpoint']}"
    if "against" in facts:
        print(f"{place}; won:")
        for name, score in facts["against"].items():
            low, high = (round(100 * score[f"won_share_{end}"]) for end in ("low", "high"))
            print(f"  {score['won']:3} of {score['games']} against {name} (95 %: {low} to {high} %)")
        return
    ends = ", ".join(f"{name} {facts[f'{name}_return']:.2f}" for name in ("max", "min", "total"))
    spread = f"mean return {facts['mean_return']:.2f}, spread {facts['std_return']:.2f}, {ends}"
    cut = f", {facts['cut']} of them cut" if facts["cut"] else ""
    print(f"{place}: {spread} over {facts['episodes']} greedy episodes of {facts['mean_steps']:.0f} steps{cut}")


evaluate = command(evaluate_episodes, show_episodes)

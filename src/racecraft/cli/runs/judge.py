"""`racecraft evaluate`: judge any run by whole episodes. A world may bring a command of that name that knows more."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from racecraft.actions.named_run import RUN_HELP, named_run
from racecraft.cli.options import Json
from racecraft.contract.errors import SettingError


def evaluate(
    run: Annotated[str, typer.Argument(metavar="RUN[:which]", help=RUN_HELP)],
    checkpoint: Annotated[
        str | None, typer.Option(help="best, last, the number of an iteration, or a merit; by default the best.")
    ] = None,
    episodes: Annotated[int | None, typer.Option(min=1, help="How many count.")] = None,
    json: Json = False,
) -> None:
    """Judge the greedy policy of a run by whole episodes.

    Examples:

        racecraft evaluate runs/CartPole-v1-1 --episodes 100
    """
    judge(*named_run(run, checkpoint), episodes, json)


def judge(run: Path, checkpoint: str | None, episodes: int | None, json: bool) -> None:
    """Judge a run by its episodes and say what came of it."""
    from racecraft.cli.output import print_json
    from racecraft.evaluation.evaluate_run import evaluate_run

    words = {} if episodes is None else {"episodes": episodes}
    facts = evaluate_run(run, checkpoint or "", **words)
    if json:
        print_json(facts)
        return
    place = f"{run}, checkpoint {facts['checkpoint']}"
    if "against" in facts:
        print(f"{place}; won:")
        for name, told in facts["against"].items():
            low, high = (round(100 * told[f"won_share_{end}"]) for end in ("low", "high"))
            print(f"  {told['won']:3} of {told['games']} against {name} (95 %: {low} to {high} %)")
        return
    spread = f"mean return {facts['mean_return']:.2f}, spread {facts['std_return']:.2f}"
    cut = f", {facts['cut']} of them cut" if facts["cut"] else ""
    print(f"{place}: {spread} over {facts['episodes']} greedy episodes of {facts['mean_steps']:.0f} steps{cut}")


def refuse_words(kind: str, words: Mapping[str, Any]) -> None:
    """Refuse options that say nothing of a run of this kind.

    Raises:
        SettingError: One of them was given.
    """
    for option, value in words.items():
        if value is not None:
            raise SettingError("{option} says nothing of a {kind} run; expected it left out.", option=option, kind=kind)

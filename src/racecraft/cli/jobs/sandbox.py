"""`racecraft sandbox`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.actions.sandbox import sandbox as action
from racecraft.cli.from_request import command

if TYPE_CHECKING:
    from racecraft.sagemaker.sandbox.create import Sandbox


def _print(made: Sandbox) -> None:
    """Say what was made, what was not and why, and the outputs."""
    from racecraft.sagemaker.sandbox.addresses import SNAKE_ADDRESS

    print(f"stack {made.plan.name}: {made.folder}")
    for name, bucket in made.buckets.items():
        print(f"made     bucket {name}: {bucket}" + (" (stood already; kept)" if name in made.kept_buckets else ""))
    for name, notebook in made.notebooks.items():
        files = ", ".join(sorted(path.name for path in notebook.iterdir())) or "empty: copy the course's files there"
        print(f"made     notebook {name}: {notebook} ({files})")
    for fate in made.plan.fates:
        if fate.made is None:
            print(f"ignored  {fate.resource} ({fate.type}): {fate.why}")
    for note in made.plan.notes:
        print(f"note     {note}")
    print("\nOutputs" if made.outputs else "\nno outputs")
    for output in made.outputs:
        print(f"  {output.name} = {output.value if output.value is not None else 'nothing here: ' + output.why}")
        if SNAKE_ADDRESS in (output.value or ""):
            print("      once `racecraft snakes serve SNAKE` runs")
        if output.rests_on:
            print(f"      rests on {', '.join(output.rests_on)}, not here: the name is made up")


sandbox = command(action, _print)

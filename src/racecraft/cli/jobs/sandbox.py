"""`racecraft sandbox TEMPLATE.yaml`: a CloudFormation template's local equivalent."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.options import Json

if TYPE_CHECKING:
    from racecraft.sagemaker.sandbox.create import Sandbox


def sandbox(
    template: Annotated[Path, typer.Argument(metavar="TEMPLATE", help="A CloudFormation template, YAML or JSON.")],
    folder: Annotated[
        Path | None, typer.Argument(metavar="[FOLDER]", help="A new folder for the notebooks; else the stack's name.")
    ] = None,
    parameter: Annotated[
        list[str] | None, typer.Option("--parameter", help="KEY=VALUE: a parameter of the template.")
    ] = None,
    stack_name: Annotated[str | None, typer.Option("--stack-name", help="Else after the template's file.")] = None,
    region: Annotated[
        str | None, typer.Option(help="What AWS::Region is; else 'local', as scripts here see it.")
    ] = None,
    json: Json = False,
) -> None:
    """Make the buckets and notebooks of a CloudFormation template as folders; list what is not here.

    Nothing in the template is run and nothing is downloaded.

    Example: racecraft sandbox deepracer.yaml --parameter CreateS3Bucket=true
    """
    from racecraft.cli.output import print_json
    from racecraft.contract.errors import SettingError
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.sagemaker.sandbox.create import make
    from racecraft.sagemaker.sandbox.stack import plan
    from racecraft.sagemaker.session import REGION

    given: dict[str, str] = {}
    for word in parameter or ():
        key, equals, value = word.partition("=")
        if not equals or not key:
            raise SettingError("--parameter {word}: no value; expected KEY=VALUE.", word=word)
        if key in given:
            raise SettingError("--parameter {key}: given twice; expected it once.", key=key)
        given[key] = value
    planned = plan(template, given, stack_name, region or REGION)
    made = make(planned, folder or Path(planned.name), JobPaths.of_user())
    print_json(made.as_dictionary()) if json else _print(made)


def _print(made: Sandbox) -> None:
    """Say what was made, what was not and why, and the outputs."""
    from racecraft.sagemaker.sandbox.addresses import SNAKE_ADDRESS

    print(f"stack {made.plan.name}: {made.folder}")
    for name, bucket in made.buckets.items():
        print(f"made     bucket {name}: {bucket}" + (" (stood already; kept)" if name in made.kept_buckets else ""))
    for name, notebook in made.notebooks.items():
        print(f"made     notebook {name}: {notebook} (empty: copy the course's files there)")
    for fate in made.plan.fates:
        if fate.made is None:
            print(f"ignored  {fate.resource} ({fate.type}): {fate.why}")
    for note in made.plan.notes:
        print(f"note     {note}")
    print("\nOutputs" if made.outputs else "\nno outputs")
    for told in made.outputs:
        print(f"  {told.name} = {told.value if told.value is not None else 'nothing here: ' + told.why}")
        if SNAKE_ADDRESS in (told.value or ""):
            print("      once `racecraft snakes serve SNAKE` runs")
        if told.rests_on:
            print(f"      rests on {', '.join(told.rests_on)}, not here: the name is made up")

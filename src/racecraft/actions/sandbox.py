"""A CloudFormation template's local equivalent."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.sagemaker.sandbox.create import Sandbox


@dataclass(frozen=True, kw_only=True)
class SandboxRequest(Request):
    """Which template becomes which folders."""

    template: Path = argument("A CloudFormation template, YAML or JSON.", metavar="TEMPLATE")
    folder: Path | None = argument("A new folder for the notebooks; else the stack's name.", None, metavar="[FOLDER]")
    parameter: tuple[str, ...] = option((), "KEY=VALUE: a parameter of the template.")
    stack_name: str | None = option(None, "Else after the template's file.")
    region: str | None = option(None, "What AWS::Region is; else 'local', as scripts here see it.")


@action
def sandbox(request: SandboxRequest, progress: Progress = quiet) -> Sandbox:
    """Make the buckets and notebooks of a CloudFormation template as folders; list what is not here.

    Nothing in the template is run and nothing is downloaded.

    Example: racecraft sandbox deepracer.yaml --parameter CreateS3Bucket=true
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.sagemaker.sandbox.create import make
    from racecraft.sagemaker.sandbox.stack import plan
    from racecraft.sagemaker.session import REGION

    given: dict[str, str] = {}
    for word in request.parameter:
        key, equals, value = word.partition("=")
        if not equals or not key:
            raise SettingError("--parameter {word}: no value; expected KEY=VALUE.", word=word)
        if key in given:
            raise SettingError("--parameter {key}: given twice; expected it once.", key=key)
        given[key] = value
    planned = plan(request.template, given, request.stack_name, request.region or REGION)
    return make(planned, request.folder or Path(planned.name), JobPaths.of_user())

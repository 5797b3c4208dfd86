"""`racecraft dr`: one command for each dr- command; bin/activate.sh puts the prefix before the folder's shell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import typer

from racecraft.actions.action import Action
from racecraft.cli.from_request import command, shared_options
from racecraft.cli.runs.export import show as show_exported
from racecraft.cli.runs.report import show as show_report
from racecraft.cli.runs.watch import show as show_watched
from racecraft.worlds.deepracer.actions.drfc.custom_files import download_custom_files, upload_custom_files
from racecraft.worlds.deepracer.actions.drfc.environment import shell_env, update_env
from racecraft.worlds.deepracer.actions.drfc.evaluate import run_evaluation, start_evaluation, stop_evaluation
from racecraft.worlds.deepracer.actions.drfc.installation import Installation
from racecraft.worlds.deepracer.actions.drfc.local_bucket import local_aws
from racecraft.worlds.deepracer.actions.drfc.logs import logs_robomaker, logs_sagemaker
from racecraft.worlds.deepracer.actions.drfc.summary import summary
from racecraft.worlds.deepracer.actions.drfc.train import (
    increment_training,
    run_training,
    start_training,
    stop_all,
    stop_training,
)
from racecraft.worlds.deepracer.actions.drfc.upload import (
    download_model,
    increment_upload_model,
    upload_car_zip,
    upload_model,
)
from racecraft.worlds.deepracer.actions.drfc.viewer import (
    run_viewer,
    start_loganalysis,
    start_metrics,
    start_viewer,
    stop_viewer,
)
from racecraft.worlds.deepracer.cli.dr import removed, shown
from racecraft.worlds.deepracer.cli.logs import show as show_logs

HELP = "The commands of DeepRacer for Cloud, without Docker; `racecraft init FOLDER` makes them dr- commands."
WORDS = {"ignore_unknown_options": True}

app = typer.Typer(
    help=HELP, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="markdown"
)
app.callback()(shared_options(Installation, HELP))


def _add(
    name: str,
    action: Action[Any],
    show: Callable[[Any], None],
    *,
    hidden: bool = False,
    context: dict[str, bool] | None = None,
    messages_aside: bool = False,
) -> None:
    made = command(action, show, shared=Installation, messages_aside=messages_aside)
    app.command(name, hidden=hidden, context_settings=context)(made)


_add("update-env", update_env, shown.show_settings)
_add("env", shell_env, shown.show_shell_lines, hidden=True, messages_aside=True)
_add("summary", summary, shown.show_summary)
_add("upload-custom-files", upload_custom_files, shown.show_copied_files)
_add("download-custom-files", download_custom_files, shown.show_copied_files)
_add("start-training", start_training, shown.show_started)
_add("run-training", run_training, shown.show_trained, hidden=True)
_add("increment-training", increment_training, shown.show_next_training)
_add("stop-training", stop_training, shown.show_stopped)
_add("stop-all", stop_all, shown.show_stopped)
_add("start-evaluation", start_evaluation, shown.show_started)
_add("run-evaluation", run_evaluation, shown.show_judged, hidden=True)
_add("stop-evaluation", stop_evaluation, shown.show_stopped)
_add("logs-sagemaker", logs_sagemaker, shown.show_started)
_add("logs-robomaker", logs_robomaker, shown.show_started)
_add("start-viewer", start_viewer, shown.show_started)
_add("run-viewer", run_viewer, show_watched, hidden=True)
_add("stop-viewer", stop_viewer, shown.show_closed)
_add("start-loganalysis", start_loganalysis, show_logs)
_add("start-metrics", start_metrics, show_report)
_add("upload-model", upload_model, shown.show_copied_model)
_add("increment-upload-model", increment_upload_model, shown.show_raised)
_add("download-model", download_model, shown.show_copied_model)
_add("upload-car-zip", upload_car_zip, show_exported)
_add("local-aws", local_aws, shown.show_local, context=WORDS)
for name, answer in removed.COMMANDS.items():
    app.command(name=name, hidden=True, context_settings=removed.WORDS)(answer)

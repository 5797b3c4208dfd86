"""`racecraft dr`: one command for each dr- command; bin/activate.sh puts the prefix before the folder's shell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.worlds.deepracer.cli.dr import (
    bucket,
    custom_files,
    environment,
    evaluation,
    logs,
    models,
    pages,
    removed,
    stopping,
    summary,
    training,
)

EXPERIMENT = "RACECRAFT_DR_EXPERIMENT"
"""Variable of the shell in which `bin/activate.sh -e NAME` leaves the name."""

app = typer.Typer(
    help="The commands of DeepRacer for Cloud, without Docker; `racecraft init FOLDER` makes them dr- commands.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)


@app.callback()
def dr(
    context: typer.Context,
    folder: Annotated[
        Path,
        typer.Option(envvar="DR_DIR", help="The installation: a folder with run.env."),
    ] = Path("."),
    config: Annotated[Path | None, typer.Option(envvar="DR_CONFIG", help="The run.env that counts.")] = None,
    experiment: Annotated[
        str | None, typer.Option(envvar=EXPERIMENT, help="A folder below experiments/ whose files come first.")
    ] = None,
) -> None:
    """The commands of DeepRacer for Cloud, without Docker; `racecraft init FOLDER` makes them dr- commands."""
    context.obj = (folder, config, experiment)


app.command(name="update-env")(environment.update_env)
app.command(name="env", hidden=True)(environment.env)
app.command(name="summary")(summary.summary)
app.command(name="upload-custom-files")(custom_files.upload_custom_files)
app.command(name="download-custom-files")(custom_files.download_custom_files)
app.command(name="start-training")(training.start_training)
app.command(name="run-training", hidden=True)(training.run_training)
app.command(name="increment-training")(training.increment_training)
app.command(name="stop-training")(training.stop_training)
app.command(name="stop-all")(stopping.stop_all)
app.command(name="start-evaluation")(evaluation.start_evaluation)
app.command(name="run-evaluation", hidden=True)(evaluation.run_evaluation)
app.command(name="stop-evaluation")(evaluation.stop_evaluation)
app.command(name="logs-sagemaker")(logs.logs_sagemaker)
app.command(name="logs-robomaker")(logs.logs_robomaker)
app.command(name="start-viewer")(pages.start_viewer)
app.command(name="run-viewer", hidden=True)(pages.run_viewer)
app.command(name="stop-viewer")(pages.stop_viewer)
app.command(name="start-loganalysis")(pages.start_loganalysis)
app.command(name="start-metrics")(pages.start_metrics)
app.command(name="upload-model")(models.upload_model)
app.command(name="increment-upload-model")(models.increment_upload_model)
app.command(name="download-model")(models.download_model)
app.command(name="upload-car-zip")(models.upload_car_zip)
app.command(name="local-aws", context_settings=bucket.WORDS)(bucket.local_aws)
for name, answer in removed.COMMANDS.items():
    app.command(name=name, hidden=True, context_settings=removed.WORDS)(answer)

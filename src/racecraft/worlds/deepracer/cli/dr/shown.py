"""How results of dr- commands are printed."""

from __future__ import annotations

import datetime

from racecraft.actions.figures import Figures
from racecraft.worlds.deepracer.actions.drfc.custom_files import CopiedFiles
from racecraft.worlds.deepracer.actions.drfc.environment import ReadSettings, ShellLines
from racecraft.worlds.deepracer.actions.drfc.jobs import StartedJob, StoppedJobs
from racecraft.worlds.deepracer.actions.drfc.local_bucket import CopiedObject, LocalObjects
from racecraft.worlds.deepracer.actions.drfc.summary import Summary
from racecraft.worlds.deepracer.actions.drfc.train import NextTraining, TrainedModel
from racecraft.worlds.deepracer.actions.drfc.upload import CopiedModel, RaisedPrefix
from racecraft.worlds.deepracer.actions.drfc.viewer import ClosedViewer
from racecraft.worlds.deepracer.actions.evaluate import EvaluatedDrive
from racecraft.worlds.deepracer.actions.race import Raced


def show_copied_files(done: CopiedFiles) -> None:
    """Print how many files differed."""
    print(f"{done.target}: {done.files} files, {done.copied} of them new or changed")


def show_settings(read: ReadSettings) -> None:
    """Print how many variables the files hold."""
    print(f"{read.config}: {read.variables} variables, run id {read.run_id}")


def show_shell_lines(made: ShellLines) -> None:
    """Print the lines that a shell evaluates."""
    print("\n".join(made.lines))


def show_summary(summary: Summary) -> None:
    """Print a line a fact."""
    width = max(map(len, summary.facts))
    for name, value in summary.facts.items():
        text = ", ".join(value) if isinstance(value, list) else value
        print(f"{name:{width}}  {'-' if text in (None, '') else text}")
    for note in summary.notes:
        print(f"- {note}")


def show_started(started: StartedJob) -> None:
    """Print what the job does; its log follows."""
    if started.sentence:
        print(started.sentence, flush=True)


def show_stopped(stopped: StoppedJobs) -> None:
    """Print how each job ended."""
    for name, state in stopped.states.items():
        print(f"{name}: {state}")
    if stopped.model:
        print(f"the model lies in {stopped.model}")


def show_trained(trained: TrainedModel) -> None:
    """Print nothing: the training has reported each iteration."""


def show_next_training(following: NextTraining) -> None:
    """Print what run.env says now."""
    config = following.config
    begins = f"the next training is {following.prefix} and begins with {following.pretrained_prefix}"
    print(f"{config}: {begins}; the old file is {config}.bak")
    print("dr-update-env takes it over into this shell.")


def show_judged(judged: EvaluatedDrive | Figures | Raced) -> None:
    """Print laps, or the standings of a race against another car."""
    from racecraft.worlds.deepracer.cli.evaluate import show
    from racecraft.worlds.deepracer.cli.race import print_standings

    if isinstance(judged, Raced):
        print(f"{judged.laps} laps on {judged.track.title or judged.track.name}:")
        print_standings(judged.result)
    else:
        show(judged)


def show_closed(done: ClosedViewer) -> None:
    """Print that the viewer is closed."""
    if done.is_closed:
        print("the viewer is closed")


def show_copied_model(done: CopiedModel) -> None:
    """Print what would be copied; a copy that was made has been reported."""
    if not done.is_copied:
        print(f"would copy {done.description}; nothing was done")


def show_raised(done: RaisedPrefix) -> None:
    """Print the new prefix."""
    print(f"DR_UPLOAD_S3_PREFIX is {done.prefix}")


def show_local(found: LocalObjects | CopiedObject) -> None:
    """Print what was copied, or a line an object, as `aws s3 ls` does."""
    if isinstance(found, CopiedObject):
        print(f"copied {found.source} to {found.target}")
        return
    for one in found.objects:
        when = datetime.datetime.fromtimestamp(one.modified).strftime("%Y-%m-%d %H:%M:%S")
        print(f"{'PRE':>30} {one.name}/" if one.is_folder else f"{when} {one.bytes:>10} {one.name}")

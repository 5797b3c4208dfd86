"""What a world brings along, as one object: `WorldKind`, and the parts it is made of.

A package registers its object under the entry point group `racecraft.worlds` (pyproject.toml of ours and of a
stranger's alike); `contract/kinds.py` finds it. A hook names a piece of code as "package.module" or
"package.module:name" and is imported when it is asked for, so that nobody waits for a world that is not used.

    KIND = WorldKind(
        name="corridor",
        title="Corridor",
        training="my_package.training",
        make_world="my_package.world:Corridor",
        judging_world="my_package.training:judging_world",
    )
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pkgutil import resolve_name
from typing import Any

TRAIN, JUDGE, UNDERSTAND = "Train", "Watch and judge", "Understand"
WORLDS, EXCHANGE, WORKSHOP = "Worlds", "In and out", "Workshop"
PANELS = (TRAIN, JUDGE, UNDERSTAND, WORLDS, EXCHANGE, WORKSHOP)
"""Headings of `racecraft --help`, in this order."""


def load(target: str) -> Any:
    """Import "package.module", or what "package.module:name.attribute" names in it, and return it.

    >>> load("pathlib:Path.cwd").__name__
    'cwd'
    """
    return resolve_name(target if ":" in target else f"{target}:")


@dataclass(frozen=True)
class Command:
    """A command, or a group of commands, of the command line."""

    name: str
    target: str
    """A function that Typer understands, or a `typer.Typer`. A CONTEXT in its module holds the settings of the
    command's context."""
    panel: str = WORLDS
    """Heading below which `racecraft --help` lists it; one of PANELS."""
    queues: tuple[str, ...] = ()
    """Words behind it that put a training into the queue at once: its interpreter begins to import meanwhile."""


@dataclass(frozen=True)
class Score:
    """How the scores of a kind's checkpoints are called."""

    name: str = "return (sum of rewards)"
    """With the unit, as an axis of a chart has it."""
    best: str = "best checkpoint, mean return"
    """The score of the best checkpoint."""
    short: str = "return"
    """In a table, or beside a figure."""
    figure: str = "{:.4g}"
    """How a score is written where figures stand alone; a format of one number."""
    sentence: str = "{:.4g}"
    """How it is written in a sentence; a format of one number."""
    lowest: float | None = None
    """Where the axis of a chart begins; None: at the data."""
    highest: float | None = None
    """The best score there can be; None: there is none, or it is unknown."""


@dataclass(frozen=True)
class WorldKind:
    """What a world brings along. `name`, `title` and `training` are required, every other hook has a default.

    `WorldKind.piece` imports what a hook names; where a world leaves a hook out, racecraft does what the hook's
    sentence says.
    """

    name: str
    """What job.json calls its runs ("kind"), and users type: "battlesnake"."""
    title: str
    """For people: "Battlesnake"."""

    training: str
    """An object or module as `racecraft.training.worlds.WorldTraining`: Request, default_settings, plan, plan_resume,
    opened, summary."""
    train_command: str = ""
    """What a person types to train: "racecraft snakes train"; messages name it. Default: they name no command."""
    train: str = ""
    """The action behind that command, of `rc.train`. Default: `rc.train` cannot train in it."""
    commands: tuple[Command, ...] = ()
    """Its part of the command line."""
    names: Mapping[str, str] = field(default_factory=dict)
    """Its part of `import racecraft as rc`: names, each with what it stands for."""
    imported_ahead: tuple[str, ...] = ()
    """Modules that the interpreter of a queued training imports before it knows what is trained."""
    warm_up: str = ""
    """Function () that does once what the first training in a process waits for: it loads compiled code. A worker that
    is kept warm calls it. Default: nothing is done."""
    folder_settings: str = ""
    """Function (folder: Path) -> `actions.settings.FolderSettings`, what a user's folder sets, for `racecraft settings
    FOLDER`. Default: its users have no such folders."""

    installation: str = ""
    """Function (folder: Path) -> `actions.stores.Installation` of another program that says which buckets it uses;
    None for any other folder. Default: no folder says so."""

    make_world: str = ""
    """Function (**words) -> World, of `rc.make_world(name, **words)`. Default: only a training makes its worlds."""
    gymnasium_envs: Mapping[str, tuple[str, str | None]] = field(default_factory=dict)
    """Ids for `gymnasium.make` ("racecraft/Battlesnake-v0"), each with its environment and its vector environment."""
    open_run: str = ""
    """Function (path: str) -> RunFolder | None, of a path that is no run folder: another program's model, opened as
    a run that lasts as long as this process; None for what it does not know. Default: it knows none."""

    evaluate: str = ""
    """Function (run: RunFolder, which: str, **words) -> dict of figures. Default: whole episodes in `judging_world`,
    asked by `episodes` and `seed`."""
    evaluate_words: tuple[str, ...] = ("episodes", "seed")
    """Keywords that `evaluate` takes."""
    evaluate_action: str = ""
    """The action behind its own `racecraft evaluate`, which `rc.evaluate` takes where more is asked than
    `evaluate_words`. Default: nothing more can be asked."""
    judging_world: str = ""
    """Function (run: RunFolder, num_worlds: int) -> context manager of a World, where its policy is judged."""
    fresh_scores: str = ""
    """Function (run: RunFolder, which: str, episodes: int) -> evaluation.fresh_starts.FreshScores, how good a
    checkpoint is from starts that did not choose it. Default: returns of whole episodes in `judging_world`."""
    score: Score = Score()
    """What its scores are called."""

    status_labels: str = ""
    """Mapping of the words for how its episodes end to those of metrics for other programs ("off_track": "Off track").
    Default: the words themselves."""

    facts: str = ""
    """Function (facts: RunFacts) -> WorldFacts, what a report says first of a run of this kind. Default: its title,
    algorithm and score."""
    report_parts: str = ""
    """Function (facts: RunFacts, plots: Sequence[Path]) -> Iterable[PagePart], the world's own parts of a run's report;
    `plots` are files with the user's own plots. Default: none."""
    aws_use: str = ""
    """Function (facts: RunFacts) -> analysis.aws_cost.AwsUse, what a run with metrics would have used of AWS's
    services. Default: an instance for each machine, and a notebook, for as long as it took."""
    evaluation_table: str = ""
    """Function (evaluations: list of evaluations/*.json) -> EvaluationTable | None. Default: one of mean returns."""
    advice: str = ""
    """Function (run: RunFolder, learner: Learner, found: list[Advice]) -> list[Advice]: what to try next; `found` is
    what the learner's figures suggest. Default: that alone."""
    as_typed: str = ""
    """Function (command: str, job) -> str: advice's "racecraft train …" as it is typed for a run of this kind.
    Default: `train_command` in its place."""
    watch: str = ""
    """Function (run: RunFolder) -> `serving.watch_server.WatchSource`: the template of the page of `racecraft
    watch`, and what its modules ask for beyond curves. Default: curves alone."""
    look: str = ""
    """Why its runs have no live picture, a sentence for the live page. Default: a general one."""

    league: str = ""
    """A class as `racecraft.league.world_part.LeagueWorld`: how its models are checked at entry and how they race.
    Default: it has no races."""
    race_commands: tuple[Command, ...] = ()
    """Commands of `racecraft league` that make its races."""

    console: str = ""
    """A subclass of `racecraft.console.parts.WorldParts`: what its runs show in lists, and the form in which a model
    is made. Default: score and curves, and no form."""

    notebooks: str = ""
    """Function (folder: Path, names: Collection[str]) -> list[Path]: writes those notebooks of these names that this
    world brings, for `racecraft sandbox`. Default: it brings none."""

    lessons: str = ""
    """A package of lessons about this world, as `racecraft.lessons.course` describes it. Default: none."""

    pictures: str = ""
    """Function (trained: training.trainer.Trained, pictures: bool, progress) -> dict, after a training: leaves pictures
    and pages in the run folder, where `pictures`, and returns their paths by kind. Default: the run's report."""
    exporters: Mapping[str, str] = field(default_factory=dict)
    """For `racecraft export --to NAME`: function (run: Path, to: str, which: str | None, output: Path | None,
    check: bool) -> export.exported.Exported; `which` None: the best checkpoint."""
    export_refusal: str = ""
    """Function (run: RunFolder) -> str: why none of its exporters can write this run, as they say it; "": they can.
    Default: they can."""
    export_instead: str = "`racecraft serve RUN` answers for it over HTTP, rc.load_policy('RUN') loads it in Python."
    """What can be done with a run for which there is no exporter, a sentence."""
    demonstration_suffix: str = ""
    """Ending of another program's demonstration files that `demonstrations` reads: ".demo"."""
    demonstrations: str = ""
    """Function (path: Path) -> `formats.demonstrations.Demonstrations` of such a file, or of a folder of them. Default:
    only racecraft's own files are read."""

    def piece(self, hook: str) -> Any:
        """Import and return what a hook names ("evaluate"); None where this world leaves it out."""
        target = getattr(self, hook)
        return load(target) if target else None

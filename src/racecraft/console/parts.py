"""What a world adds to the console's pages: `WorldParts`, whose defaults serve a world that adds nothing.

A world names its subclass in `WorldKind.console`; the console asks `parts_of`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from racecraft.console.form import Step
from racecraft.console.section import Section
from racecraft.console.workspace import Note
from racecraft.contract.errors import SettingError
from racecraft.contract.kind import WorldKind
from racecraft.contract.kinds import MissingWorldError, find_kind
from racecraft.formats.run_folder import RunFolder
from racecraft.pages.chart import Chart, Series

if TYPE_CHECKING:
    from racecraft.actions.action import Action
    from racecraft.evaluation.run_groups import SeedGroup
    from racecraft.league.race import Race

Rows = Sequence[Mapping[str, Any]]
"""Rows of a run's metrics."""


@dataclass(frozen=True, kw_only=True)
class Card:
    """What a list says of a run beyond what every run has."""

    place: str = ""
    """Where the agent acts, for people: "re:Invent 2018"."""
    picture: str = ""
    """What `WorldParts.picture` draws of the place; "": there is no picture."""
    about: str = ""
    """What is peculiar about it, one line."""
    rank: float | None = None
    """Its best result as a number that is smaller for a better one: seconds of a lap, a score with its sign changed."""
    best_text: str = ""
    """The same for people: "6.53 s"."""
    gap_percent: float | None = None
    """How far the best result is from the best known one, per cent."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A large number of a model's page."""

    value: str
    unit: str = ""
    label: str = ""


@dataclass(frozen=True)
class Look:
    """A closer look at what stands on a page, made in the console's helper process; the page does not wait for it."""

    template: str
    """Draws what the function returned."""
    function: str
    """As "package.module:name", imported in the other process alone; it returns what the template shows. Where that
    has `remarks`, each with line, bad and text, an editor of the page shows them."""
    arguments: tuple[Any, ...]
    modules: tuple[str, ...] = ()
    styles: tuple[str, ...] = ()
    """Modules and styles that the template needs: the page that asks for the look brings them."""


@dataclass(frozen=True)
class RaceDrive:
    """What a model drove in a race."""

    race: Race
    track: str
    """Where."""
    folder: Path
    """Its files."""
    seat: int
    """Its place in the heat, from 0."""


@dataclass(frozen=True, kw_only=True)
class RaceMaking:
    """How a race of a world is made: the form is made of the options of the action's request."""

    action: Action[Any]
    command: str
    """What is typed for it, behind `racecraft`: "league create"."""
    first: tuple[str, ...]
    """Options that stand unfolded at the top, in order."""
    choices: Mapping[str, Sequence[tuple[str, str]]]
    """(value, label) of options whose values are a list: {"track": …}."""


class WorldParts:
    """What a world adds to the console's pages.

    Args:
        kind: The world.
    """

    noun = "agent"
    """What one of its models is called: "car"."""
    lesson = ""
    """What the first training of this world promises, for the first page; "": it offers none."""
    first: Mapping[str, Any] = MappingProxyType({})
    """What the first training sets otherwise than `defaults`."""

    def __init__(self, kind: WorldKind) -> None:
        self.kind = kind

    def card(self, run: RunFolder, job: Mapping[str, Any], metrics: Rows) -> Card:
        """Return what a list says of a run."""
        scores = [row["evaluation_score"] for row in metrics if row.get("evaluation_score") is not None]
        best = max(scores, default=None)
        return Card(
            place=str(job.get("title", "")),
            rank=None if best is None else -best,
            best_text="" if best is None else f"{self.kind.score.figure.format(best)} {self._unit}".strip(),
        )

    def figures(self, row: Mapping[str, Any]) -> list[Figure]:
        """Return the first large numbers of a model's page, of its row of the index."""
        return [
            Figure(value=row["best_text"].removesuffix(f" {self._unit}") or "–", label=f"best {self.kind.score.short}")
        ]

    stage = ""
    """Template of what moves on a model's page: map, board, film; it knows `from`, where `WorldKind.watch` answers."""
    stage_modules: tuple[str, ...] = ()
    stage_styles: tuple[str, ...] = ()
    """Modules and styles that the template needs."""

    def charts(self, row: Mapping[str, Any], metrics: Rows) -> list[Chart]:
        """Return the charts of a model's page."""
        return [reward_graph(self.kind, metrics)]

    def compared(self) -> list[tuple[str, str, str]]:
        """Return the curves in which models are compared: title, axis, column of the metrics."""
        return [("Score while training", self.kind.score.name, "evaluation_score")]

    def compared_look(self, groups: Sequence[SeedGroup]) -> Look | None:
        """Return the closer look at what compared runs did, side by side; None: this world has none."""
        return None

    def tabs(self, row: Mapping[str, Any]) -> list[tuple[str, str]]:
        """Return further pages of a model that has a run: (what the tab says, what follows the model's address)."""
        return []

    def tab_page(
        self, row: Mapping[str, Any], tab: str, query: Mapping[str, str], drives: Callable[[], Sequence[RaceDrive]]
    ) -> tuple[str, dict[str, Any]]:
        """Return a page of `tabs`: its template, which extends "racecraft.console/model_frame.html", and its data.

        Args:
            row: The model's row.
            tab: The last word of its address.
            query: The words behind its address.
            drives: Reads what the model drove in races, the newest first.

        Raises:
            UserInputError: There is no such page, or the run cannot be read.
        """
        raise SettingError("{tab}: {title} has no such page.", tab=tab[:40], title=self.kind.title)

    def tab_task(self, row: Mapping[str, Any], tab: str) -> tuple[str, list[str]] | None:
        """Return what a page of `tabs` can ask for: in words ("Explaining"), and the words behind `racecraft`.

        Its form is sent to the page's own address; what the command wrote, the page shows.
        """
        return None

    def look(self, row: Mapping[str, Any], tab: str, query: Mapping[str, str]) -> Look | None:
        """Return the closer look that belongs to a page of `tabs`; arguments as of `tab_page`."""
        return None

    def look_ahead(self, step: str, values: Mapping[str, Any], query: Mapping[str, str]) -> Look | None:
        """Return the closer look at what was chosen in a step of the form.

        Args:
            step: Its key.
            values: What was chosen until now.
            query: The words behind the look's address.
        """
        return None

    def sections(self) -> Sequence[Section]:
        """Return further pages of the console that belong to no model: tracks, driving by hand."""
        return ()

    def race_making(self) -> RaceMaking | None:
        """Return how a race of this world is made; None: it has no races."""
        return None

    def drive_page(
        self, race: Race, track: str, drives: Sequence[tuple[str, Path, int]], query: Mapping[str, str]
    ) -> tuple[str, dict[str, Any]]:
        """Return the template and the data of a drive in a race; by default its places, film and files.

        Args:
            race: The race.
            track: Where it was driven.
            drives: Racer, folder and seat in the heat (from 0) of the drive, and of those beside which it can be seen,
                the leader's first.
            query: Words of the address.

        Raises:
            UserInputError: A drive cannot be read.
        """
        return "drive.html", {}

    def has_picture(self, key: str) -> bool:
        """Tell whether `picture` draws a place."""
        return False

    def picture(self, key: str) -> str:
        """Return a place as the text of an SVG file.

        Raises:
            UserInputError: There is no such place.
        """
        raise MissingWorldError("{key}: {title} has no pictures of places.", key=key, title=self.kind.title)

    def defaults(self) -> dict[str, Any]:
        """Return what a new model of this world begins with, by the names of `steps`."""
        return {field.name: field.default for step in self.steps({}) for field in step.fields}

    def steps(self, values: Mapping[str, Any]) -> list[Step]:
        """Return the steps in which a model of this world is made; none: it is made by the command line alone.

        Args:
            values: What was chosen until now.
        """
        return []

    def note(self, values: Mapping[str, Any]) -> Note:
        """Return what is known of a model before it has a run."""
        return Note(kind=self.kind.name)

    def files(self, values: Mapping[str, Any]) -> dict[str, str]:
        """Return the files of a new model's folder, text by name.

        Raises:
            UserInputError: A value cannot be used.
        """
        return {}

    def words(self, values: Mapping[str, Any]) -> list[str]:
        """Return the words behind `racecraft` that begin the training, typed in the model's folder.

        Raises:
            UserInputError: A value cannot be used.
        """
        raise NotImplementedError

    def import_words(self, archive: Path, run: Path) -> list[str]:
        """Return the words behind `racecraft` that make a run of another program's model; none: it cannot."""
        return []

    def words_of_files(self, archive: Path, folder: Path) -> list[str]:
        """Return the words behind `racecraft` that make a model's folder of files without weights; none: it cannot.

        The command answers with `files`, `notes` and `has_logs`.
        """
        return []

    def log_words(self, log: Path, page: Path) -> Sequence[list[str]]:
        """Return commands, the words behind `racecraft`, of which the first that can writes a page about a log alone.

        Of a log without a model; none: it reads no logs.
        """
        return []

    def values_of(self, run: RunFolder) -> dict[str, Any]:
        """Return the values of the form that a run was made with, as far as it tells: a clone begins with them.

        Raises:
            RunFolderError: The run cannot be read.
        """
        return {}

    def require_same_body(self, values: Mapping[str, Any], base: Mapping[str, Any]) -> None:
        """Refuse a clone whose weights would not fit it.

        Args:
            values: Of the clone.
            base: Of the model that is cloned.

        Raises:
            SettingError: A value that weights depend on differs.
        """

    def summary(self, values: Mapping[str, Any]) -> list[tuple[str, str]]:
        """Return what is chosen, in a few words: (what, how)."""
        return []

    def remarks(self, values: Mapping[str, Any]) -> list[str]:
        """Return what is worth knowing of these values; a remark forbids nothing."""
        return []

    @property
    def _unit(self) -> str:
        return "" if "%" in self.kind.score.figure else self.kind.score.short


def reward_graph(kind: WorldKind, metrics: Rows) -> Chart:
    """Return the console's own graph: average reward, and the score in training and evaluating."""
    score, at = kind.score, [row["iteration"] for row in metrics]
    judged = [row for row in metrics if row.get("evaluation_score") is not None]
    return Chart(
        "Reward graph",
        "iteration",
        score.name,
        [
            Series("average reward", at, [row.get("mean_reward") for row in metrics], right=True, colour=3),
            Series("training", at, [row.get("training_score") for row in metrics], colour=1),
            Series(
                "evaluating",
                [row["iteration"] for row in judged],
                [row["evaluation_score"] for row in judged],
                "both",
                colour=2,
            ),
        ],
        right="average reward",
        low=score.lowest,
        high=score.highest,
    )


def checkpoint_text(which: str) -> str:
    """Return which checkpoint is meant, for people.

    >>> checkpoint_text("last"), checkpoint_text("12")
    ('last checkpoint', 'checkpoint 12')
    """
    return f"checkpoint {which}" if which.isdigit() else f"{which} checkpoint"


@cache
def parts_of(name: str) -> WorldParts:
    """Return what a world adds.

    Raises:
        MissingWorldError: It is not installed.
    """
    kind = find_kind(name)
    parts: WorldParts = (kind.piece("console") or WorldParts)(kind)
    return parts

"""A member's round is a training command of ours, run as a job. Begin with `PopulationTrials`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.job_spec import JobSpec
from racecraft.formats.population import MemberRound
from racecraft.formats.run_folder import CHECKPOINTS
from racecraft.formats.tensor_file import CheckpointError
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.submit import environment_here, submit_numbered
from racecraft.jobs.tuning.space import Parameter, as_text
from racecraft.jobs.tuning.training_trials import TRIALS, Objective, TrainingTrial, legal_name, split_verb

ADDING_UP = ("minutes", "iterations", "steps")
"""Stops of which a run that goes on for another round needs as much again."""
FIXED = "network."
"""Settings that weights hang on, so that they cannot change where weights are taken over."""


class PopulationTrials:
    """Begins members' rounds: a launcher for `population.train`.

    Args:
        folder: Of the population.
        words: The command behind `racecraft`, one round of it: ("gym", "train", "CartPole-v1", "--stop=minutes=1").
        objective: What counts; the last figure of a round does.
        cores: That each member takes.
        home: Where the jobs lie.
    """

    def __init__(self, folder: Path, words: Sequence[str], objective: Objective, cores: int, home: JobPaths) -> None:
        self._folder, self._words, self._objective = folder, tuple(words), objective
        self._cores, self._home = cores, home

    def __call__(self, one: MemberRound, parent: MemberRound | None) -> PopulationTrial:
        """Begin a member's round, or go on with what was broken off; a job of it that is under way is taken up."""
        place = self._folder / TRIALS / one.run
        trial = PopulationTrial("", place, self._objective, self._home)
        trial.name = self._under_way(place) or self._begin(one, parent, place)
        return trial

    def _begin(self, one: MemberRound, parent: MemberRound | None, place: Path) -> str:
        verb, rest = split_verb(self._words)
        rounds = one.round - one.begun + 1
        stops = scaled_stops(rest, rounds)
        resume = (*verb, f"--run={place}", "--resume", *(word for word in stops if word.startswith("--stop")))
        if rounds > 1:
            command = resume
        else:
            sets = (f"--set={name}={as_text(value)}" for name, value in one.values.items())
            first_stops = stops if parent is None else without_from(stops)
            weights = () if parent is None else (f"--from={self._folder / TRIALS / parent.run}:{parent.iteration}",)
            command = (*verb, *sets, f"--run={place}", *weights, *first_stops)

        def spec(name: str) -> JobSpec:
            return JobSpec(
                command=command,
                name=name,
                resume=resume,
                run=str(place),
                folder=str(Path.cwd()),
                environment=environment_here(),
                cores=self._cores,
                recorded={"population": str(self._folder), "member": one.member, "round": one.round},
            )

        return submit_numbered(self._home, f"{legal_name(self._folder.name)}-{one.member}-{one.round}", spec).name

    def _under_way(self, place: Path) -> str | None:
        """Return the job that trains into a run folder now; None where there is none."""
        store = self._home.store()
        try:
            return next((job.name for job in store.jobs() if not job.ended and job.spec.run == str(place)), None)
        finally:
            store.close()


class PopulationTrial(TrainingTrial):
    """A member's round under way."""

    def last_iteration(self) -> int | None:
        """Return the iteration of its last checkpoint; None without one."""
        try:
            return Checkpoints(self.place / CHECKPOINTS).find("last").iteration
        except (CheckpointError, RunFolderError):
            return None


def check_round(words: Sequence[str], parameters: Mapping[str, Parameter]) -> None:
    """Refuse a command whose rounds have no end of their own, and settings that weights hang on.

    Raises:
        SettingError: See above.
    """
    stops = [word.removeprefix("--stop=") for word in words if word.startswith("--stop=")]
    if not any(stop.partition("=")[0] in ADDING_UP for stop in stops):
        raise SettingError(
            "a round needs a --stop of {adding_up}; found {stops}. Expected one, such as "
            "--stop minutes=1: as much is trained in every round.",
            adding_up=", ".join(ADDING_UP),
            stops=", ".join(stops),
        )
    for name in parameters:
        if name.startswith(FIXED):
            raise SettingError(
                "--param {name}: a member takes over another's weights, which hang on it; expected settings that may "
                "change in the middle of a training, such as ppo.learning_rate. The other samplers vary any.",
                name=name,
            )


def scaled_stops(words: Sequence[str], rounds: int) -> tuple[str, ...]:
    """Return a command's words with the stops that add up given so many times.

    >>> scaled_stops(("CartPole-v1", "--stop=minutes=0.5", "--stop=score=475"), 3)
    ('CartPole-v1', '--stop=minutes=1.5', '--stop=score=475')
    """
    return tuple(_scaled(word, rounds) if word.startswith("--stop=") else word for word in words)


def without_from(words: Sequence[str]) -> tuple[str, ...]:
    """Return a command's words without `--from` and what it names.

    >>> without_from(("CartPole-v1", "--from", "runs/1", "--stop=minutes=1"))
    ('CartPole-v1', '--stop=minutes=1')
    """
    kept: list[str] = []
    is_named = False
    for word in words:
        if not is_named and word != "--from" and not word.startswith("--from="):
            kept.append(word)
        is_named = word == "--from"
    return tuple(kept)


def _scaled(word: str, rounds: int) -> str:
    kind, _, amount = word.removeprefix("--stop=").partition("=")
    if kind not in ADDING_UP:
        return word
    try:
        return f"--stop={kind}={float(amount) * rounds:.12g}"
    except ValueError:
        return word

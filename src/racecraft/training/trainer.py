"""From an experiment to a run folder: the one road to the loop, for every world. Begin with `train`.

    settings, processor → learner → run folder → evaluator, collector, writer → the loop → what came of it

What a world brings along is its `Experiment`; how one is planned from a request, `worlds.py` knows.
"""

from __future__ import annotations

import contextlib
import shlex
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import torch

from racecraft.algorithms.alphazero import SEARCHED
from racecraft.algorithms.building import build_learner
from racecraft.algorithms.learner import REPLAY, Learner
from racecraft.algorithms.registry import Algorithm, require_fit
from racecraft.algorithms.replay_sampler import ReplayLearner
from racecraft.algorithms.weights import to_arrays, to_tensors
from racecraft.contract.errors import RacecraftError, RunFolderError
from racecraft.contract.world import Array, World, WorldSpec
from racecraft.formats.checkpoint import IMPORTED, Checkpoints
from racecraft.formats.checkpoint_ranking import load_weights, split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.players.custom_code_loader import own_code_of
from racecraft.players.open_run import open_run
from racecraft.players.trained import SPEC
from racecraft.rollout.collector import Collector, CollectorProtocol
from racecraft.rollout.episodes import StepObserver
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import as_dictionary
from racecraft.training.callbacks import Callbacks, RunPathCallback, TrainingCallback
from racecraft.training.cloned_start import clone_recording, is_recording
from racecraft.training.custom_code import copy_code, own_code_in
from racecraft.training.disk_forecast import DiskForecast, forecast
from racecraft.training.loop import Evaluator, Outcome, TrainingLoop
from racecraft.training.mlflow_tracking import MlflowRun, RunDescription, client_class, tracking_uri
from racecraft.training.named_files import as_in_run, found_in_run, lay_named_files, named_files, overrides_in_run
from racecraft.training.processor import prepare_processor
from racecraft.training.remote_collection import RecordingObserver, RemoteCollector, TickCallback
from racecraft.training.resume import MessageCallback, print_already_reached, print_resumed, restore_run
from racecraft.training.run_writer import EpisodeFiles, RunWriter, Stateful, TickRecorder
from racecraft.training.stopping import StopCondition, parse_stops
from racecraft.training.tensorboard import FOLDER, TensorBoard, summary_writer
from racecraft.training.versions import machine, versions

if TYPE_CHECKING:
    from racecraft.rollout.replay import Replay

SameShape = Callable[[str, Mapping[str, Any]], tuple[str, ...]]
Fitted = Callable[[Mapping[str, Array], Mapping[str, Array]], tuple[dict[str, Array], tuple[str, ...]]]


@dataclass(frozen=True)
class RunObservers:
    """What observes a training and writes into its run folder, beside the loop."""

    recorder: TickRecorder | None = None
    """Keeps every tick for the episode files."""
    episode_files: EpisodeFiles | None = None
    """Writes them in another program's form, too."""
    observers: Iterable[StepObserver] = ()
    """See every tick."""
    on_ticks: TickCallback | None = None
    """Hears of the ticks of worlds elsewhere, rollout by rollout; observers do not."""


@dataclass(frozen=True)
class Experiment:
    """A training made definite: all but its run folder and its learner."""

    kind: str
    """What job.json calls such a run."""
    world: World
    """What is learned in."""
    algorithm: Algorithm
    settings: Settings
    seed: int
    stops: tuple[StopCondition, ...]
    evaluator: Callable[[Learner, RunFolder], Evaluator]
    """Makes whoever says how good the learner is."""
    request: Mapping[str, Any]
    """What was asked, for job.json: enough to begin again from it."""
    metadata: Mapping[str, Any]
    """What a stranger wants to know of the policy beside kind, spec and settings."""
    title: str
    """What is trained, for people."""
    folder_name: str
    """Run folders are called runs/<folder_name>-<number>."""
    job: Mapping[str, Any] = field(default_factory=dict)
    """What else job.json tells."""
    notes: tuple[str, ...] = ()
    """What is worth saying before the first tick, a clause each."""
    copy_user_files: Callable[[RunFolder], None] = lambda run: None
    """Lays copies of the user's own files into a new run folder."""
    learner: Callable[[], Learner] | None = None
    """Makes the learner; None: the algorithm's own, with these settings."""
    world_lasts: bool | None = True
    """Whether the world's state can be kept; None: nobody knows before it is tried."""
    after_update: Callable[[Learner], None] = lambda learner: None
    """Hears of the learner after each of its updates."""
    parts: Mapping[str, Stateful] = field(default_factory=dict)
    """Further parts whose state every checkpoint keeps, by name."""
    warm_up: Callable[[MessageCallback], None] = lambda on_message: None
    """Compiles what must be compiled before the clock starts."""
    open_observers: Callable[[RunFolder, Sequence[str]], contextlib.AbstractContextManager[RunObservers]] = field(
        default=lambda run, notes: contextlib.nullcontext(RunObservers())
    )
    """Opens the observers of the training in its run folder, given the notes; closed at its end."""
    same_shape: SameShape = lambda path, metadata: ()
    """Refuses the metadata of a checkpoint whose weights are not to be begun with (it hears the run's path, too); of
    one that may be, it returns what is worth saying."""
    fitted: Fitted = lambda weights, mine: (dict(weights), ())
    """Brings an earlier run's weights into the shape of this network's own, as far as the world knows how; what differs
    then is refused. It returns what is worth saying, too."""
    gatherer: RemoteCollector | None = None
    """Who carries the learner through worlds elsewhere; None: it is carried through `world`, here."""
    recorder: Callable[[], RecordingObserver] | None = None
    """Makes what keeps the ticks of worlds elsewhere for the episode files; None: none are kept."""
    stays: str = ""
    """Why its worlds cannot be elsewhere, a sentence; "" where they can."""

    @property
    def spec(self) -> WorldSpec:
        """What the worlds that are learned in promise, wherever they are."""
        return self.world.spec if self.gatherer is None else self.gatherer.spec


Distribute = Callable[[str, Any, Experiment, Callable[[str], None]], contextlib.AbstractContextManager[Experiment]]
"""Takes a kind of world, a plan and what was opened for it, and gives the same experiment with its worlds elsewhere."""


def train(
    experiment: Experiment,
    place: Path | None,
    callback: TrainingCallback,
    on_message: MessageCallback,
    source: str | None = None,
) -> tuple[RunFolder, Outcome]:
    """Train in a run folder of its own until a stop condition holds.

    Args:
        experiment: What is trained.
        place: Where the run folder is made; None: the next number under runs/.
        callback: Watches the training.
        on_message: Called with a line for a person.
        source: RUN, RUN:best, RUN:last or RUN:N, whose weights are begun with, or a file of recorded episodes, which
            is cloned first; None: fresh ones.

    Raises:
        RunFolderError: The place is taken, or the weights do not fit.
        CheckpointError: No such checkpoint, or a damaged one.
        SettingError: The algorithm does not fit the world's actions, a stop can never hold, or a replay is too large.
        MissingExtraError: Curves are to be written for TensorBoard or MLflow, and it is not installed.
    """
    _require_trackers(experiment.settings)
    learner = _learner(experiment, experiment.settings)
    feed = experience_source_for(learner, experiment)
    if source is not None:
        experiment = replace(experiment, notes=(*experiment.notes, *begin_with(learner, source, experiment)))
    _say_notes(experiment, on_message)
    own = own_code_in(learner.policy_spec)
    for clause in own.stays:
        on_message(f"- {clause}")
    run = _make_run(experiment, place, own.texts)
    experiment = replace(experiment, settings=as_in_run(experiment.settings))
    with run.lock(), experiment.open_observers(run, experiment.notes) as observers:
        session = TrainingSession(experiment, run, learner, feed, callback, observers, on_message)
        return run, session.run()


def resume(experiment: Experiment, run: RunFolder, callback: TrainingCallback, on_message: MessageCallback) -> Outcome:
    """Go on with a run from its last whole iteration, until a stop condition holds.

    Raises:
        RunFolderError: The folder is taken by a running training.
    """
    with own_code_of(run):
        learner = _learner(experiment, found_in_run(experiment.settings, run))
    feed = experience_source_for(learner, experiment)
    _say_notes(experiment, on_message)
    run.make_folders()
    with run.lock(), experiment.open_observers(run, experiment.notes) as observers:
        session = TrainingSession(experiment, run, learner, feed, callback, observers, on_message)
        run.note_resumed(session.restore(), [str(stop) for stop in experiment.stops])
        return session.run()


class TrainingSession:
    """Everybody a training needs, each in their place."""

    def __init__(
        self,
        experiment: Experiment,
        run: RunFolder,
        learner: Learner,
        feed: Replay | None,
        callback: TrainingCallback,
        observers: RunObservers,
        on_message: MessageCallback,
    ) -> None:
        settings = experiment.settings
        self._experiment, self._run, self._on_message, self._learner = experiment, run, on_message, learner
        if settings.runtime.tensorboard:
            callback = Callbacks(TensorBoard(run.path / FOLDER), callback)
        if settings.runtime.mlflow is not None:
            description = RunDescription(run.path, run.read_job())
            callback = Callbacks(MlflowRun(settings.runtime.mlflow, description, on_message), callback)
        if isinstance(callback, RunPathCallback):
            callback.run_made(run.path)
        experiment.warm_up(on_message)
        self._collector, recorder = _collector(experiment, learner, observers)
        self._replay = feed
        parts = dict(experiment.parts) | ({} if feed is None else {"replay": feed})
        self._writer = RunWriter(
            run,
            learner,
            self._collector,
            checkpoint_metadata(experiment, learner),
            recorder,
            observers.episode_files if recorder is not None else None,
            parts,
            Checkpoints(
                run.checkpoints,
                settings.runtime.keep_mib * 2**20,
                settings.runtime.keep_every,
                settings.runtime.keep_count,
            ),
            by_workers=experiment.gatherer is not None,
        )
        evaluator = experiment.evaluator(learner, run)
        parse_stops(map(str, experiment.stops), evaluator.stop_kinds)
        self._loop = TrainingLoop(
            self._collector,
            learner,
            evaluator,
            self._writer,
            callback,
            settings.rollout,
            settings.evaluation,
            experiment.stops,
            feed,
            lambda: experiment.after_update(learner),
        )

    def restore(self) -> int:
        """Take up the last whole iteration, and say so; return its number, 0 where none was saved."""
        lasts = self._experiment.world_lasts
        last, why_anew = restore_run(self._run, self._learner, self._collector, self._loop, self._writer, lasts)
        print_resumed(last, why_anew, self._on_message)
        print_already_reached(self._run, self._experiment.stops, self._on_message)
        if self._replay is not None and self._replay.begins_anew:
            self._on_message(
                "what it remembered was too large to be kept (replay.keep_mib), so its memory begins anew and the "
                "curve is not bit by bit that of an unbroken run"
            )
        return last

    def run(self) -> Outcome:
        """Train; where that fails, say what is left of it."""
        if sentence := self._forecast().sentence():
            self._on_message(sentence)
        try:
            return self._loop.run(f"{self._experiment.title}, run {self._run.path}")
        except RacecraftError:
            self._on_message(self._what_is_left())
            raise

    def _forecast(self) -> DiskForecast:
        rollout = self._experiment.settings.rollout
        weights = to_arrays(self._learner.state_dict())["network"]
        steps = rollout.num_worlds * rollout.horizon
        return forecast(weights, self._experiment.settings.runtime, self._experiment.stops, steps, self._run.path)

    def _what_is_left(self) -> str:
        """Return the line about what stands in the run folder of a training that failed."""
        run, again = self._run.path, f"--run {shlex.quote(str(self._run.path))} --resume"
        if not self._run.metrics.exists():
            return f"nothing was learned yet; {again} begins again with the files that stand in {run}"
        return f"what was learned until then stands in {run}; {again} goes on from there"


def _collector(
    experiment: Experiment, learner: Learner, observers: RunObservers
) -> tuple[CollectorProtocol, TickRecorder | None]:
    """Return what collects, here or elsewhere, and who keeps the ticks."""
    rollout, elsewhere = experiment.settings.rollout, experiment.gatherer
    if elsewhere is not None:
        return elsewhere.collector(learner, observers.on_ticks), elsewhere.recorder
    watching = [*observers.observers]
    here = Collector(experiment.world, learner, rollout.horizon, experiment.seed, watching, rollout.longest_horizon)
    return here, observers.recorder


def experience_source_for(learner: Learner, experiment: Experiment) -> Replay | None:
    """Return what stands between collector and learner: a replay where the learner eats from one; None: nothing.

    Raises:
        SettingError: The replay would need more memory than is allowed.
    """
    if learner.experience != REPLAY:
        return None
    from racecraft.rollout.replay import Replay  # with its kernels, which whoever remembers nothing starts without

    eater = cast(ReplayLearner, learner)
    settings = experiment.settings.replay
    stack_size = experiment.settings.network.stack_size
    return Replay(experiment.spec, settings, eater.discount, eater.n_step, learner.columns, stack_size)


def checkpoint_metadata(experiment: Experiment, learner: Learner) -> dict[str, Any]:
    """Return what every checkpoint says of itself: kind, how to rebuild the policy, settings, what the world adds."""
    return {
        "kind": experiment.kind,
        SPEC: learner.policy_spec.as_dictionary(),
        **experiment.metadata,
        "settings": as_dictionary(experiment.settings),
        "versions": versions(),
    }


def begin_with(learner: Learner, source: str, experiment: Experiment) -> tuple[str, ...]:
    """Give a learner the weights of an earlier run, of a model of AWS's, or of a clone of recorded episodes.

    Optimiser and counts start from zero.

    Returns:
        What is worth saying about them, a clause each.

    Raises:
        UserInputError: As `weights_to_begin_with`.
    """
    if is_recording(source):
        return clone_recording(learner, Path(source), experiment.spec, experiment.settings, experiment.seed)
    mine = to_arrays(learner.state_dict())["network"]
    weights, notes = weights_to_begin_with(source, mine, experiment.kind, experiment.same_shape, experiment.fitted)
    learner.load_state_dict({"network": to_tensors(weights)})
    return notes


def weights_to_begin_with(
    source: str, mine: Mapping[str, Array], kind: str, same_shape: SameShape, fitted: Fitted
) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Return the weights of an earlier run for a network whose own are `mine`, and what is worth saying about them.

    Args:
        source: RUN, RUN:best, RUN:last, RUN:N, or a model of AWS's.
        mine: The network's own, by name.
        kind: What kind of run it must be.
        same_shape: As in `Experiment`.
        fitted: As in `Experiment`.

    Raises:
        RunFolderError: No such run, a run of another kind, or a network of another shape.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    path, which = split_source(source)
    run = open_run(path)
    run.read_job_of(kind)
    found, metadata = load_weights(run, which)
    notes = same_shape(path, metadata)
    weights, more = fitted(found, mine)
    for name in sorted(set(mine) | set(weights)):
        here = tuple(mine[name].shape) if name in mine else "absent"
        there = weights[name].shape if name in weights else "absent"
        if here != there:
            raise RunFolderError(
                "{path}: its network is of another shape ({name} is {there} there and {here} here); expected the "
                "same algorithm, observations, actions and network settings. Give --set network.… as it was, or train "
                "afresh.",
                path=path,
                name=name,
                there=there,
                here=here,
            )
    return weights, (*notes, *more, *metadata.get(IMPORTED, ()))


def summary_of(outcome: Outcome, run: RunFolder, seed: int) -> dict[str, Any]:
    """Return the figures that `--json` prints of any training."""
    judged = outcome.last
    return {
        "solved": bool(judged and judged.solved),
        "seconds": round(outcome.seconds, 3),
        "env_steps": outcome.steps,
        "iterations": outcome.iterations,
        "env_steps_per_second": round(outcome.steps / outcome.seconds, 1) if outcome.seconds else None,
        "evaluation": judged.details if judged else None,
        "stopped_by": outcome.reason,
        "run": str(run.path),
        "seed": seed,
        "versions": versions(),
    }


def _require_trackers(settings: Settings) -> None:
    """Look whether whoever is to be told of the training can be, before anything is made."""
    if settings.runtime.tensorboard:
        summary_writer()
    if settings.runtime.mlflow is not None:
        tracking_uri(settings.runtime.mlflow, Path("."))
        client_class(settings.runtime.mlflow)


def _learner(experiment: Experiment, settings: Settings) -> Learner:
    prepare_processor(settings.runtime.threads, settings.runtime.device)
    world = experiment.world.spec
    require_fit(experiment.algorithm, world.actions, experiment.title, is_searched=SEARCHED in world.observations)
    if experiment.learner is not None:
        return experiment.learner()
    return build_learner(experiment.algorithm, experiment.spec, settings, experiment.seed)


def note_on_schedules(settings: Settings, algorithm: Algorithm, stops: Sequence[StopCondition]) -> tuple[str, ...]:
    """Say where something is to fall until the training ends, and neither steps nor minutes say when.

    Returns:
        A clause, or none.
    """
    if any(stop.kind in ("steps", "minutes") for stop in stops) or not algorithm.group:
        return ()
    falling = [
        f"{algorithm.group}.{name}"
        for name, value in as_dictionary(settings)[algorithm.group].items()
        if name.endswith("_schedule") and value == "linear"
    ]
    if not falling:
        return ()
    names = ", ".join(falling)
    return (f"{names}: linear, but no stop steps= or minutes= says until when; what they rule stays as it is set",)


def _say_notes(experiment: Experiment, on_message: MessageCallback) -> None:
    schedules = note_on_schedules(experiment.settings, experiment.algorithm, experiment.stops)
    for note in (*experiment.notes, *schedules):
        on_message(f"- {note}")


def _make_run(experiment: Experiment, place: Path | None, code: Mapping[str, str]) -> RunFolder:
    """Make the run folder and lay copies of the user's files into it."""
    named = named_files(experiment.settings)
    request = dict(experiment.request)
    if "set" in request:
        request["set"] = overrides_in_run(request["set"], experiment.settings)

    def copy_user_files(run: RunFolder) -> None:
        experiment.copy_user_files(run)
        lay_named_files(named, run)
        copy_code(code, run)

    job = {
        "kind": experiment.kind,
        "title": experiment.title,
        "algorithm": experiment.algorithm.name,
        "asked": {**request, "stops": [str(stop) for stop in experiment.stops]},
        **experiment.job,
        "settings": as_dictionary(as_in_run(experiment.settings)),
        "notes": list(experiment.notes),
        "seed": experiment.seed,
        "versions": versions(),
        "machine": machine(),
        "threads": torch.get_num_threads(),
        "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }
    if place is None:
        return RunFolder.create_numbered(Path("runs"), experiment.folder_name, job, copy_user_files)
    return RunFolder.create(place, job, copy_user_files)

"""Take up a run where it was broken off: its last whole iteration. Begin with `restore_run`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol

from racecraft.algorithms.learner import Learner
from racecraft.algorithms.weights import to_tensors, with_policy
from racecraft.contract.errors import ContractError, RunFolderError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder, ten_minutes_more
from racecraft.rollout.collector import CollectorProtocol, WorkerLayoutError
from racecraft.training.stopping import Progress, StopCondition, reached
from racecraft.training.versions import versions

MessageCallback = Callable[[str], None]


class Restores(Protocol):
    """Whoever takes up what it said of itself in a checkpoint's state."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from that."""
        ...


def open_to_resume(path: Path, kind: str) -> tuple[RunFolder, dict[str, Any], tuple[str, ...]]:
    """Return a run folder, its job, and what is worth saying about going on with it.

    Args:
        path: The run folder.
        kind: What its job.json must call itself.

    Raises:
        RunFolderError: No run folder, or the run of another kind of world.
    """
    run = RunFolder.open(path)
    job = run.read_job_of(kind)
    notes: list[str] = []
    if job["versions"] != versions():
        notes.append(f"versions differ from those the run began with ({job['versions']}): the curve may differ")
    return run, job, tuple(notes)


def restore_run(
    run: RunFolder,
    learner: Learner,
    collector: CollectorProtocol,
    loop: Restores,
    writer: Restores,
    world_lasts: bool | None = True,
) -> tuple[int, str]:
    """Take up the last whole iteration; metrics of what came after it are cut off.

    Args:
        run: Where it lies.
        learner: Takes its weights, optimiser and chance.
        collector: Takes the worlds' state.
        loop: Takes its counts.
        writer: Takes what its parts noted.
        world_lasts: Whether the world goes on where it was; False: its episodes begin anew; None: they do if it shows
            something else than it did.

    Returns:
        Its number, 0 where none was saved; and why its episodes begin anew, a clause, "" where they do not.

    Raises:
        RunFolderError: An older racecraft wrote the state.
        ContractError: The world shows something else than it did, although it was said to last.
    """
    run.clear_stop()
    checkpoints = Checkpoints(run.checkpoints)
    entries = [entry for entry in checkpoints.entries() if entry.state is not None]
    if not entries:
        run.cut_metrics(0)
        return 0, ""
    last = entries[-1].iteration
    state = checkpoints.load_state(str(last))
    _require_known(run, state["loop"])
    weights, _ = checkpoints.load_policy(str(last))
    learner.load_state_dict(to_tensors(with_policy(state["learner"], weights)))
    writer.restore(state)
    why = _restore_worlds(collector, state["collector"], world_lasts)
    loop.restore(state["loop"])
    run.cut_metrics(last)
    return last, why


def print_resumed(iteration: int, why_anew: str, on_message: MessageCallback) -> None:
    """Say where a run goes on."""
    if not iteration:
        on_message("no whole iteration was saved: starts fresh")
    elif not why_anew:
        on_message(f"goes on after iteration {iteration}")
    else:
        on_message(
            f"goes on after iteration {iteration}; {why_anew}, so its episodes begin anew and the curve is not bit by "
            "bit that of an unbroken run"
        )


def print_already_reached(run: RunFolder, stops: Iterable[StopCondition], on_message: MessageCallback) -> None:
    """Say so where a resumed run has nothing left to do, and what to ask for instead."""
    metrics = run.read_metrics()
    if not metrics:
        return
    seconds, iterations, steps = (metrics[-1][name] for name in ("seconds", "iteration", "steps"))
    stop = reached(stops, Progress(seconds, iterations, steps, is_stable=False))
    if stop is not None:
        on_message(
            f"{stop} holds already, so nothing is trained: stops count from the run's birth, and it has had "
            f"{seconds / 60.0:.1f} min, {iterations:,} iterations and {steps:,} steps; for ten minutes more: "
            f"--stop {ten_minutes_more(metrics)}"
        )


def _require_known(run: RunFolder, loop: Mapping[str, Any]) -> None:
    if "solved_in_a_row" not in loop:
        raise RunFolderError(
            "{path}: its trainer state was written by an older racecraft, in another order; expected one of this "
            "version. Begin a new run with its weights: --from {path}:last.",
            path=run.path,
        )


def _restore_worlds(collector: CollectorProtocol, state: Mapping[str, Any], world_lasts: bool | None) -> str:
    """Have the worlds go on where they were, or begin anew; return why they do, "" where they go on."""
    why = "the world's inner state cannot be kept"
    if world_lasts is not False:
        try:
            collector.restore(state)
            return ""
        except WorkerLayoutError as otherwise:
            why = str(otherwise)
        except ContractError:
            if world_lasts:
                raise
    collector.restore(state, anew=True)
    return why

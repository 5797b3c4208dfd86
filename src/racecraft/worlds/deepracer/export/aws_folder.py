"""A run as AWS's own model folder, with TensorFlow's checkpoints and frozen graphs. Begin with `export_to_aws`.

A run folder already has AWS's layout for all but the weights (`files/model_folder.py`). What is written here::

    model/N_Step-S.ckpt.index  .data-00000-of-00001  .meta     of the best and the last, or of one that is named
    model/model_N.pb                                           the policy of each, frozen
    model/.coach_checkpoint    deepracer_checkpoints.json      which to begin from
    output/model.tar.gz                                        what a physical car takes, of the best
    model_metadata.json  reward_function.py  training_params.yaml  ip/  metrics/  copies of the run's own

The console's import form wants metadata and hyperparameters at the top, too.
"""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.formats.archive import GZIPPED
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.checkpoint import CheckpointEntry
from racecraft.formats.checkpoint_ranking import find_checkpoint
from racecraft.formats.policy_layers import PolicyLayersError
from racecraft.formats.run_folder import HYPERPARAMETERS, MODEL_METADATA, REWARD_FUNCTION, RunFolder
from racecraft.worlds.deepracer.export.agreement import Agreement, compare
from racecraft.worlds.deepracer.export.car_model import car_layers, graph_answer, metadata_text
from racecraft.worlds.deepracer.files.car_archive import GRAPH, METADATA, archive_folder, write_archive
from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder, CheckpointMark, write_checkpoint_marks
from racecraft.worlds.deepracer.files.policy_graph import graph_of
from racecraft.worlds.deepracer.files.policy_layers import require_aws_network
from racecraft.worlds.deepracer.files.policy_weights import arrays_of
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import write_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import write_graph, write_meta_graph
from racecraft.worlds.deepracer.players.trained_car import KIND, load_trained_car

COPIES = (
    REWARD_FUNCTION, MODEL_METADATA, HYPERPARAMETERS, "training_params.yaml", f"ip/{HYPERPARAMETERS}",
    "metrics/TrainingMetrics.json",
)  # fmt: skip
"""What of a run goes along as it is, where it is there."""
COACH_CHECKPOINT = ".coach_checkpoint"


@dataclass(frozen=True)
class AwsExport:
    """What was written and how it was checked."""

    path: Path
    """The folder, or the archive."""
    checkpoints: tuple[str, ...]
    """Names of the checkpoints within."""
    agreement: Agreement | None
    """Of the best with its graph; None: it was not checked."""


def export_to_aws(
    run: str | Path, to: str, output: str | Path | None = None, check: bool = True, which: str | None = None
) -> AwsExport:
    """Write a run as a model folder ("drfc"), or as the archive of one ("console").

    Args:
        run: The run folder of `racecraft train`.
        to: "drfc" or "console".
        output: A new folder, or a file that ends in .tar.gz; None: in `<run>/export`.
        check: Whether the best graph is asked beside its checkpoint first.
        which: The one checkpoint that goes along, as the best and the last; None: the best and the last there are.

    Raises:
        RunFolderError: No run folder, or the run of another kind of world.
        UserInputError: AWS's trainer knows no such network, or the folder is taken.
        ExportError: The graph does not act as the checkpoint does; nothing is written.
    """
    folder = RunFolder.open(run)
    folder.read_job_of(KIND)
    name = folder.path.resolve().name
    if to == "drfc":
        place = Path(output) if output is not None else folder.path / "export" / name
        if place.exists() and (not place.is_dir() or any(place.iterdir())):
            raise SettingError(
                "{place}: something stands there; expected a new folder. Give another with --output.", place=place
            )
        return _filled(folder, which, place, place, check)
    place = Path(output) if output is not None else folder.path / "export" / f"{name}.tar.gz"
    if not place.name.endswith(GZIPPED):
        raise SettingError("--output {place}: expected a file that ends in .tar.gz.", place=place)
    make_folder(place.parent)
    with tempfile.TemporaryDirectory(prefix="racecraft-export-") as temporary:
        done = _filled(folder, which, Path(temporary), place, check)
        archive_folder(place, temporary)
    return done


def _filled(run: RunFolder, which: str | None, place: Path, named: Path, check: bool) -> AwsExport:
    """Fill a folder; nothing is written before every checkpoint was told and the best one checked."""
    best, last = find_checkpoint(run, which or "best"), find_checkpoint(run, which or "last")
    entries = {entry.iteration: entry for entry in (best, last)}
    filled = {}
    for number in entries:
        car = load_trained_car(run.path, str(number))
        layers = car_layers(car)
        try:
            require_aws_network(layers)
        except PolicyLayersError as error:
            raise UserInputError("{path}: {error}", path=run.path, error=error) from error
        filled[number] = car, layers, graph_of(layers)
    car, layers, graph = filled[best.iteration]
    frozen = write_graph(graph)
    agreement = compare(car, layers, graph_answer(layers, frozen)) if check else None

    folder = AwsModelFolder(place)
    for part in (place / "model", place / "output"):
        make_folder(part)
    for number, (_, layers, graph) in filled.items():
        prefix = place / "model" / _mark(run, entries[number]).name
        write_checkpoint(prefix, arrays_of(layers))
        write_atomic(f"{prefix}.meta", write_meta_graph(graph))
        write_atomic(place / "model" / f"model_{number}.pb", write_graph(graph))
    write_checkpoint_marks(folder.checkpoint_marks, _mark(run, best), _mark(run, last))
    write_atomic(place / "model" / COACH_CHECKPOINT, _mark(run, best).name)
    metadata = metadata_text(car).encode()
    write_atomic(folder.model_metadata, metadata)
    write_archive(place / "output" / "model.tar.gz", {GRAPH: frozen, METADATA: metadata})
    for copy in COPIES:
        if (run.path / copy).is_file():
            make_folder((place / copy).parent)
            shutil.copyfile(run.path / copy, place / copy)
    return AwsExport(named, tuple(_mark(run, entry).name for entry in entries.values()), agreement)


def _mark(run: RunFolder, entry: CheckpointEntry) -> CheckpointMark:
    moment = (run.checkpoints / entry.policy).stat().st_mtime
    return CheckpointMark(entry.iteration, entry.steps, entry.score, round(moment, 3))

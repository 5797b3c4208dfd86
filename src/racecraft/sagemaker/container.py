"""The folders a SageMaker script expects, inside a folder of the job, and how it is run there.

Facts: battlesnake-and-sagemaker-rl.md C.4. Begin with `make_job_folders` (before the job) and
`entered` (in its process)::

    opt/ml/code                  the script, what lay beside it, its dependencies
    opt/ml/input/config          hyperparameters.json, resourceconfig.json, inputdataconfig.json
    opt/ml/input/data/CHANNEL    what fit(inputs) named
    opt/ml/model                 what the script leaves here becomes model.tar.gz
    opt/ml/output/data           … and here output.tar.gz
    opt/ml/output/intermediate   films and the like, while it trains
    opt/ml/output/failure        why it failed
    opt/ml/checkpoints           stays when the job is interrupted

`SAGEMAKER_BASE_DIR` names this opt/ml, so any number of jobs run side by side. A script that says "/opt/ml" itself
instead of asking SM_MODEL_DIR writes to the real one.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import sys
import tarfile
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from racecraft.contract.errors import InputFileError, UserInputError
from racecraft.contract.message import Message
from racecraft.formats.atomic import OutputFileError, atomic_file, make_folder, output_error, write_atomic
from racecraft.jobs.capacity import Capacity
from racecraft.jobs.hyperparameters import OWN_KEYS, as_arguments, decoded, encoded

HOST = "algo-1"
FOLDERS = (
    "code", "input/config", "input/data", "model", "output/data", "output/intermediate", "checkpoints",
)  # fmt: skip
NOT_CODE = shutil.ignore_patterns("__pycache__", "*.pyc", ".git", ".ipynb_checkpoints")
MAX_FAILURE_CHARACTERS = 1024


class CodeError(InputFileError):
    """A script, a source folder or a dependency of an estimator cannot be used."""


class ChannelError(UserInputError):
    """An input of `fit` cannot be used."""


@dataclass(frozen=True)
class Container:
    """A job's own opt/ml."""

    root: Path

    @property
    def code(self) -> Path:
        """Where the script lies."""
        return self.root / "code"

    @property
    def model(self) -> Path:
        """Where it leaves what is to be kept."""
        return self.root / "model"

    @property
    def model_data(self) -> Path:
        """The packed model, once the job is over."""
        return self.root.parent.parent / "output" / "model.tar.gz"

    @property
    def output_data(self) -> Path:
        """The packed output, once the job is over."""
        return self.root.parent.parent / "output" / "output.tar.gz"


def container_in(folder: Path) -> Container:
    """Return the container in a job's folder; it need not exist."""
    return Container(folder / "opt" / "ml")


def make_job_folders(
    folder: Path,
    entry_point: str,
    source_dir: str | None,
    dependencies: Sequence[str],
    hyperparameters: Mapping[str, Any],
    channels: Mapping[str, Path],
) -> Container:
    """Make a job's folders and copy its code into them.

    Args:
        folder: The job's own.
        entry_point: The script: in `source_dir`, or a path where there is none.
        source_dir: Folder whose content lies beside it; None: nothing does.
        dependencies: Folders and files that lie beside it, too, each under its own name; of one that ends with a
            slash what it holds, as the SDK packs it, unless it is a package itself.
        hyperparameters: Plain values.
        channels: What `fit` names, by channel.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written.
    """
    try:
        return _prepared(folder, entry_point, source_dir, dependencies, hyperparameters, channels)
    except shutil.Error as error:  # several files at once
        raise OutputFileError(
            "{folder}: the code cannot be copied there ({error}).", folder=folder, error=str(error)[:200]
        ) from error
    except OSError as error:
        raise OutputFileError(output_error(folder, error)) from error


def _prepared(
    folder: Path,
    entry_point: str,
    source_dir: str | None,
    dependencies: Sequence[str],
    hyperparameters: Mapping[str, Any],
    channels: Mapping[str, Path],
) -> Container:
    container = container_in(folder)
    for name in FOLDERS:
        make_folder(container.root / name)
    if source_dir is None:
        shutil.copy2(entry_point, container.code)
    else:
        shutil.copytree(source_dir, container.code, dirs_exist_ok=True, ignore=NOT_CODE)
    for dependency in dependencies:
        _copy_dependency(dependency, container.code)
    for name, place in channels.items():
        _link_channel(container.root / "input" / "data" / name, place)
    config = container.root / "input" / "config"
    _write(config / "hyperparameters.json", encoded(hyperparameters))
    _write(config / "resourceconfig.json", {"current_host": HOST, "hosts": [HOST], "network_interface_name": "lo"})
    _write(config / "inputdataconfig.json", {name: {"TrainingInputMode": "File"} for name in channels})
    return container


def _copy_dependency(dependency: str, code: Path) -> None:
    path = Path(dependency)
    if not path.is_dir():
        shutil.copy2(path, code)
        return
    holds_packages = dependency.endswith("/") and not (path / "__init__.py").exists()
    target = code if holds_packages else code / path.resolve().name
    shutil.copytree(path, target, dirs_exist_ok=True, ignore=NOT_CODE)


def check_code(entry_point: str, source_dir: str | None, dependencies: Sequence[str], ours: Sequence[str]) -> list[str]:
    """Look whether all code is there; return the dependencies to lay beside the script.

    Args:
        entry_point: The script.
        source_dir: Its folder.
        dependencies: Further folders.
        ours: Names of packages that `racecraft run` lends; one of these need not be there.

    Raises:
        CodeError: Something is not there, or is not what it should be.
    """
    if source_dir is not None and str(source_dir).startswith(("s3://", "git://", "https://")):
        raise CodeError(source_dir, "an address", "a folder of this machine", "Copy it here first.")
    if source_dir is not None and not Path(source_dir).is_dir():
        raise CodeError(source_dir, "there is no such folder", "source_dir, the folder with the entry point")
    script = Path(source_dir or ".", entry_point)
    if not script.is_file():
        beside = sorted(path.name for path in script.parent.glob("*.py")) if script.parent.is_dir() else []
        raise CodeError(
            script,
            "there is no such file",
            "entry_point, a Python script",
            Message("There are: {beside}.", beside=", ".join(beside) or "none"),
        )
    if script.suffix != ".py":
        raise CodeError(
            script, Message("a {suffix}", suffix=script.suffix or "file"), "a Python script, such as train.py"
        )
    kept = []
    for dependency in dependencies:
        if Path(dependency).exists():
            kept.append(str(dependency))
        elif Path(dependency).name not in ours:
            raise CodeError(dependency, "there is no such folder or file", "one of the estimator's dependencies")
    return kept


@contextlib.contextmanager
def entered(folder: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield a job's script and its arguments, in its folders; afterwards what it left is packed.

    A failure is written down as SageMaker has it, and raised again; what was left until then is packed, too.
    """
    container = container_in(folder)
    config = container.root / "input" / "config"
    hyperparameters = decoded(json.loads((config / "hyperparameters.json").read_text(encoding="utf-8")))
    script = container.code / hyperparameters["sagemaker_program"]
    os.environ.update(sm_variables(container, hyperparameters))
    os.chdir(container.code)
    sys.path.insert(0, str(container.code))
    signal.signal(signal.SIGTERM, _leave)
    try:
        yield script, as_arguments(hyperparameters)
    except BaseException as error:
        if not (isinstance(error, SystemExit) and error.code in (None, 0)):
            text = "".join(traceback.format_exception(error))[-MAX_FAILURE_CHARACTERS:]
            write_atomic(container.root / "output" / "failure", text)
        raise
    finally:
        pack(container)


def pack(container: Container) -> None:
    """Pack what a script left: model.tar.gz and output.tar.gz."""
    make_folder(container.model_data.parent)
    for source, target in ((container.model, container.model_data), (container.root / "output", container.output_data)):
        with atomic_file(target) as part, tarfile.open(part, "w:gz", compresslevel=1) as bundle:
            for path in sorted(source.iterdir()):
                bundle.add(path, arcname=path.name)


def sm_variables(container: Container, hyperparameters: Mapping[str, Any]) -> dict[str, str]:
    """Return the SM_… variables of a job (facts: C.4)."""
    root, cores = container.root, int(os.environ.get("OMP_NUM_THREADS") or Capacity.of_machine().cores)
    channels = sorted(path.name for path in (root / "input" / "data").iterdir())
    own = {name: value for name, value in hyperparameters.items() if name not in OWN_KEYS}
    program = str(hyperparameters["sagemaker_program"])
    job = str(hyperparameters.get("sagemaker_job_name", ""))
    resources = {"current_host": HOST, "hosts": [HOST], "network_interface_name": "lo"}
    places = {
        "SM_MODEL_DIR": root / "model",
        "SM_INPUT_DIR": root / "input",
        "SM_INPUT_CONFIG_DIR": root / "input" / "config",
        "SM_OUTPUT_DIR": root / "output",
        "SM_OUTPUT_DATA_DIR": root / "output" / "data",
        "SM_OUTPUT_INTERMEDIATE_DIR": root / "output" / "intermediate",
        "SM_MODULE_DIR": root / "code",
    }
    facts = {
        "SM_CHANNELS": channels,
        "SM_HPS": own,
        "SM_HOSTS": [HOST],
        "SM_RESOURCE_CONFIG": resources,
        "SM_INPUT_DATA_CONFIG": {name: {"TrainingInputMode": "File"} for name in channels},
        "SM_USER_ARGS": as_arguments(hyperparameters),
        "SM_FRAMEWORK_PARAMS": {name: value for name, value in hyperparameters.items() if name in OWN_KEYS},
    }
    variables = {
        "SAGEMAKER_BASE_DIR": str(root),
        "SAGEMAKER_JOB_NAME": job,
        "TRAINING_JOB_NAME": job,
        "SM_CURRENT_HOST": HOST,
        "SM_NUM_CPUS": str(cores),
        "SM_NUM_GPUS": "0",
        "SM_LOG_LEVEL": "20",
        "SM_NETWORK_INTERFACE_NAME": "lo",
        "SM_MODULE_NAME": program.removesuffix(".py"),
        "SM_USER_ENTRY_POINT": program,
        **{name: str(place) for name, place in places.items()},
        **{name: json.dumps(value) for name, value in facts.items()},
        **{f"SM_CHANNEL_{name.upper()}": str(root / "input" / "data" / name) for name in channels},
        **{f"SM_HP_{name.upper()}": _plain(value) for name, value in own.items()},
    }
    training = {**resources, "hyperparameters": own, "job_name": job, "num_cpus": cores, "num_gpus": 0}
    return {**variables, "SM_TRAINING_ENV": json.dumps(training)}


def local_path(address: str, buckets: Path) -> Path:
    """Return where an input lies: a path, file://…, or s3://bucket/… among the folders that stand for buckets."""
    if address.startswith("s3://"):
        return buckets / address.removeprefix("s3://").strip("/")
    return Path(address.removeprefix("file://"))


def channels_of(inputs: Any, buckets: Path) -> dict[str, Path]:
    """Return what `fit(inputs)` names, by channel.

    Args:
        inputs: None, an address, {"channel": address}, or objects that hold one (TrainingInput).
        buckets: Folders that stand for buckets.

    Raises:
        ChannelError: Something is not there.
    """
    named = {} if inputs is None else inputs if isinstance(inputs, Mapping) else {"training": inputs}
    found = {}
    for name, channel in named.items():
        address = channel if isinstance(channel, str | Path) else getattr(channel, "address", None)
        if address is None:
            raise ChannelError(
                "fit(inputs): channel '{name}' is {said!r}; expected a path, file://… or s3://….",
                name=name,
                said=channel,
            )
        place = local_path(str(address), buckets)
        if not place.exists():
            raise ChannelError(
                "fit(inputs): channel '{name}' names {address}, and there is no {place}; expected a folder or a file. "
                "Session().upload_data puts files into a bucket's folder.",
                name=name,
                address=address,
                place=place,
            )
        found[name] = place.absolute()
    return found


def _link_channel(target: Path, place: Path) -> None:
    """Lay an input before the script: a link where the system has links, else a copy."""
    if place.is_file():
        make_folder(target)
        shutil.copy2(place, target)
        return
    try:
        target.symlink_to(place, target_is_directory=True)
    except OSError:
        shutil.copytree(place, target)


def _leave(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)


def _write(path: Path, value: Any) -> None:
    write_atomic(path, json.dumps(value, indent=2) + "\n")


def _plain(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)

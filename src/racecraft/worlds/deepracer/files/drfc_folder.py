"""A folder of DeepRacer for Cloud: its settings, its bucket, and where in it everything lies.

Begin with `open_drfc_folder`. The layout is the one racers know, but that the bucket is a folder like any other::

    system.env, run.env         settings; worker-2.env and so on for further courses
    custom_files/               the racer's three files, where they are edited
    experiments/<name>/         the same files again, which come first while DR_EXPERIMENT_NAME says so
    bin/activate.sh             defines the dr- commands
    bucket/                     DR_LOCAL_S3_BUCKET
        custom_files/           DR_LOCAL_S3_CUSTOM_FILES_PREFIX: what a training reads
        rl-deepracer-sagemaker/ DR_LOCAL_S3_MODEL_PREFIX: a run folder

Nothing here writes. A prefix that would leave its bucket is refused. Where a bucket is S3, the folder is what this
machine has of it; `local_is_s3` and `upload_is_s3` say when, and `files/drfc_buckets.py` where it is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from racecraft.contract.errors import UserInputError
from racecraft.contract.message import Message
from racecraft.worlds.deepracer.files.run_env import (
    EnvFolder,
    RunEnv,
    RunEnvError,
    read_env_files,
    without_curly_quotes,
)
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME

RUN_ENV, SYSTEM_ENV = "run.env", "system.env"
CUSTOM_FILES = "custom_files"
EXPERIMENTS = "experiments"
LOADED = "RACECRAFT_DR_LOADED"
"""Variable of the shell in which dr-update-env leaves the digest of the files it read."""
SHELL = Path("the shell")
"""Stands for the file of a value that was set in the shell."""
MAX_RUN_ID = 999
CLOUDS = ("local", "aws", "azure", "remote")
"""Kinds of storage that DeepRacer for Cloud knows; by itself none of them makes the bucket anything but a folder."""
S3 = "s3://"
ENDPOINTS = ("DR_LOCAL_S3_ENDPOINT_URL", "DR_REMOTE_MINIO_URL", "DR_MINIO_URL")
"""Variables that name the local bucket's store, the first that counts first."""
TEMPLATE_PROFILES = ("", "default", "minio")
"""Profiles that stand in a folder without anybody having chosen them."""


@dataclass(frozen=True)
class DrfcFolder:
    """An installation, as it is read now."""

    path: Path
    """The installation's own folder, DR_DIR."""
    config: Path
    """The run.env that counts, DR_CONFIG."""
    env: EnvFolder
    digest: str
    """Of all files that were read."""
    notes: tuple[str, ...] = ()
    """What is worth telling the user beside the notes of the files, a clause each."""

    @property
    def run_id(self) -> int:
        """Number of the run, DR_RUN_ID.

        Raises:
            RunEnvError: It is no whole number from 0 to MAX_RUN_ID.
        """
        written = self.text("DR_RUN_ID")
        if not (written.isascii() and written.isdecimal()) or int(written) > MAX_RUN_ID:
            raise self.error_at("DR_RUN_ID", Message("a whole number from 0 to {max_run_id}", max_run_id=MAX_RUN_ID))
        return int(written)

    @property
    def custom_files(self) -> Path:
        """Where the racer's files are edited."""
        return (self._experiment or self.path) / CUSTOM_FILES

    @property
    def bucket(self) -> Path:
        """The folder that stands for the bucket.

        Raises:
            RunEnvError: Its name leaves the installation, or the kind of storage is none.
        """
        self.env.run.choice("DR_CLOUD", "local", CLOUDS)
        return self._below(self.path, "DR_LOCAL_S3_BUCKET")

    @property
    def endpoint_variable(self) -> str:
        """The variable that names the local bucket's store; empty where none does."""
        for name in ENDPOINTS:
            if self.text(name) and (name != "DR_REMOTE_MINIO_URL" or self.text("DR_CLOUD") == "remote"):
                return name
        return ""

    @property
    def local_is_s3(self) -> bool:
        """Whether the local bucket is S3: an endpoint, a profile of one's own, or an s3:// address is named."""
        chosen = self.text("DR_LOCAL_S3_PROFILE") not in TEMPLATE_PROFILES
        return bool(self.endpoint_variable) or chosen or self.text("DR_LOCAL_S3_BUCKET").startswith(S3)

    @property
    def upload_is_s3(self) -> bool:
        """Whether the bucket for uploads is S3: a profile of one's own, or an s3:// address is named."""
        name = self.text("DR_UPLOAD_S3_BUCKET")
        return bool(name) and (name.startswith(S3) or self.text("DR_UPLOAD_S3_PROFILE") not in TEMPLATE_PROFILES)

    @property
    def model(self) -> Path:
        """The run folder of the model, DR_LOCAL_S3_MODEL_PREFIX in the bucket."""
        return self._below(self.bucket, "DR_LOCAL_S3_MODEL_PREFIX")

    @property
    def opponent(self) -> Path:
        """The run folder of the model that is raced, DR_EVAL_OPP_S3_MODEL_PREFIX in the bucket."""
        return self._below(self.bucket, "DR_EVAL_OPP_S3_MODEL_PREFIX")

    @property
    def custom_prefix(self) -> Path:
        """Where in the bucket a training looks for the racer's files."""
        return self._below(self.bucket, "DR_LOCAL_S3_CUSTOM_FILES_PREFIX")

    @property
    def upload(self) -> Path:
        """Where dr-upload-model puts a model: DR_UPLOAD_S3_PREFIX in the bucket for uploads.

        Raises:
            RunEnvError: No bucket for uploads is named.
        """
        if not self.text("DR_UPLOAD_S3_BUCKET"):
            raise self.error_at(
                "DR_UPLOAD_S3_BUCKET",
                "the name of a folder for uploads, such as upload",
                "Give it a name in system.env, or upload into the local bucket with -L.",
                found="it has no value",
            )
        return self._below(self.upload_bucket, "DR_UPLOAD_S3_PREFIX")

    @property
    def upload_bucket(self) -> Path:
        """The folder that stands for the bucket for uploads, where one is named."""
        return self._below(self.path, "DR_UPLOAD_S3_BUCKET")

    def key(self, name: str) -> Path:
        """Return the file in the bucket that a variable such as DR_LOCAL_S3_REWARD_KEY names."""
        return self._below(self.bucket, name)

    def in_bucket(self, prefix: str) -> Path:
        """Return the place of a prefix that was typed, or of an s3:// address whose bucket is one of ours.

        Raises:
            UserInputError: It leaves the bucket, or names a bucket that is none of ours.
        """
        bucket = self.bucket
        if prefix.startswith("s3://"):
            name, _, prefix = prefix.removeprefix("s3://").partition("/")
            ours = {bucket.name: bucket}
            if self.text("DR_UPLOAD_S3_BUCKET"):
                ours.setdefault(self.upload_bucket.name, self.upload_bucket)
            if name not in ours:
                raise UserInputError(
                    "s3://{name}: is no bucket of {path}; expected {ours}. "
                    "`racecraft bucket pull s3://{name}/PREFIX {bucket}/PREFIX` fetches from others.",
                    name=name,
                    path=self.path,
                    ours=" or ".join(ours),
                    bucket=bucket,
                )
            bucket = ours[name]
        if not _stays_inside(prefix):
            raise UserInputError("{prefix!r}: leaves the bucket; expected a prefix such as my-model-2.", prefix=prefix)
        return bucket / prefix

    def text(self, name: str) -> str:
        """Return a value, or what a new installation has, with the variables of its default filled in."""
        return self.env.run.values.get(name) or default_text(name, self.env.run)

    def flag(self, name: str) -> bool:
        """Return a value as true or false.

        Raises:
            RunEnvError: It is neither.
        """
        return self.env.run.flag(name, BY_NAME[name].default.casefold() == "true")

    def error_at(
        self, name: str, expected: str | Message, hint: str | Message = "", found: str | Message = ""
    ) -> RunEnvError:
        """Return the error about a value, with its file and line; of one that stands nowhere, with the run.env."""
        if name in self.env.run.values:
            return self.env.run.error_at(name, expected, hint, found)
        return RunEnvError(self.config, found or Message("'{text}'", text=self.text(name)), expected, hint, key=name)

    @property
    def _experiment(self) -> Path | None:
        place = self.config.parent
        return place if place.parent.resolve() == (self.path / EXPERIMENTS).resolve() else None

    def _below(self, folder: Path, name: str) -> Path:
        prefix = self.text(name).removeprefix(S3).rstrip("/")
        if not _stays_inside(prefix):
            raise self.error_at(name, "a name that stays inside its folder, such as my-model-2")
        return folder / prefix


def open_drfc_folder(
    path: str | Path,
    config: str | Path | None = None,
    experiment: str | None = None,
    shell: Mapping[str, str] | None = None,
) -> DrfcFolder:
    """Read an installation's settings, and lay over them what the shell says otherwise.

    The later word counts. Where the files are still those that dr-update-env read, a variable that differs was set in
    the shell afterwards and wins; where the files were edited since, they win, and that is said.

    Args:
        path: The installation.
        config: The run.env; None: that of the experiment, else the installation's own.
        experiment: A folder below experiments/; None: what DR_EXPERIMENT_NAME says, if anything.
        shell: The variables of the shell; none: the files alone.

    Raises:
        UserInputError: There is no installation.
        RunEnvError: A file is missing or damaged.
    """
    path, shell = Path(path), shell or {}
    if not path.is_dir():
        what = "is a file" if path.exists() else "there is no such folder"
        raise UserInputError(
            "{path}: {what}; expected a folder with run.env. `racecraft init {path}` makes one.", path=path, what=what
        )
    files = _env_files(path, config, experiment)
    env = read_env_files(*files, workers=files[-1].parent)
    digest = _digest(files)
    run, notes = _with_shell(env.run, shell, digest)
    drfc = DrfcFolder(path, files[-1], replace(env, run=run), digest, notes)
    if run.text("DR_CLOUD", "local") == "local" or drfc.local_is_s3:
        return drfc
    folder = f"DR_CLOUD={run.text('DR_CLOUD')}: the bucket is a folder here all the same, until an endpoint, a profile "
    return replace(drfc, notes=(*notes, folder + "or an s3:// address is named"))


def default_text(name: str, env: RunEnv) -> str:
    """Return what a variable is where nobody gives it, with the variables in its default filled in."""
    text = BY_NAME[name].default
    for other in sorted(BY_NAME, key=len, reverse=True):  # the longest first: one name may begin another
        if f"${other}" in text:
            text = text.replace(f"${other}", env.values.get(other) or default_text(other, env))
    return text


def _env_files(path: Path, config: str | Path | None, experiment: str | None) -> list[Path]:
    """Return the files that count, the later over the earlier; the run.env is the last."""
    system, run = path / SYSTEM_ENV, Path(config) if config else path / RUN_ENV
    if experiment is None and config is None and run.is_file():
        named = read_env_files(*([system] if system.is_file() else []), run).run
        experiment = named.values.get("DR_EXPERIMENT_NAME")
    if experiment:
        place = path / EXPERIMENTS / experiment
        if not _stays_inside(experiment) or not place.is_dir():
            there = sorted(one.name for one in (path / EXPERIMENTS).glob("*") if one.is_dir())
            raise UserInputError(
                "{place}: there is no such experiment; expected one of {path}: "
                "{there}. Make the folder with a run.env and custom_files in it.",
                place=place,
                path=path / EXPERIMENTS,
                there=", ".join(there) or "none yet",
            )
        system = place / SYSTEM_ENV if (place / SYSTEM_ENV).is_file() else system
        run = place / RUN_ENV if (place / RUN_ENV).is_file() else run
    if not run.is_file():
        raise UserInputError(
            "{run}: there is no such file; expected the settings of DeepRacer for Cloud. "
            "`racecraft init {path}` makes a folder with them.",
            run=run,
            path=path,
        )
    return [system, run] if system.is_file() else [run]


def _with_shell(env: RunEnv, shell: Mapping[str, str], digest: str) -> tuple[RunEnv, tuple[str, ...]]:
    values = {name: without_curly_quotes(value) for name, value in shell.items() if name in BY_NAME}
    differing = {
        name: value
        for name, value in values.items()
        if value and value != (env.values.get(name) or default_text(name, env)) and name not in ("DR_DIR", "DR_CONFIG")
    }
    if not differing:
        return env, ()
    names = ", ".join(sorted(differing))
    if shell.get(LOADED, digest) != digest:
        return env, (f"the files were changed since dr-update-env, so they count and not the shell: {names}",)
    places = {name: (SHELL, None) for name in differing}
    changed = replace(env, values={**env.values, **differing}, locations={**env.locations, **places})
    return changed, (f"set in the shell, which counts before the files: {names}",)


def _digest(files: list[Path]) -> str:
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()[:16]


def _stays_inside(prefix: str) -> bool:
    """Tell whether a prefix names something below the folder it is put behind.

    >>> [_stays_inside(prefix) for prefix in ("a/b-2", "../a", "/a", "a/../..", "C:a", "")]
    [True, False, False, False, False, False]
    """
    parts = PurePosixPath(prefix.replace("\\", "/")).parts
    return bool(parts) and not {"..", "/"} & set(parts) and ":" not in prefix and "\0" not in prefix

"""`aws s3 ls` and `aws s3 cp` of the local bucket of a DeepRacer-for-Cloud folder, which is a folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import argument
from racecraft.worlds.deepracer.actions.drfc.copying import copy_files
from racecraft.worlds.deepracer.actions.drfc.installation import InstallationRequest

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder


@dataclass(frozen=True, kw_only=True)
class LocalAwsRequest(InstallationRequest):
    """What is typed behind `aws`."""

    args: tuple[str, ...] = argument("s3 ls [s3://…] or s3 cp FROM TO, with --recursive.", (), metavar="[ARGS]...")


@dataclass(frozen=True)
class LocalObject:
    """A file or a folder of the bucket."""

    name: str
    is_folder: bool
    bytes: int
    modified: float
    """Seconds since 1970."""


@dataclass(frozen=True)
class LocalObjects:
    """What `s3 ls` lists."""

    objects: list[LocalObject]


@dataclass(frozen=True)
class CopiedObject:
    """What `s3 cp` copied."""

    source: Path
    target: Path


@action
def local_aws(request: LocalAwsRequest, progress: Progress = quiet) -> LocalObjects | CopiedObject:
    """Say `s3 ls` or `s3 cp` to the local bucket; it is a folder, so every other program can look into it as well.

    Examples:

        racecraft dr local-aws s3 ls s3://bucket/rl-deepracer-sagemaker/

        racecraft dr local-aws s3 cp s3://bucket/custom_files/reward_function.py .
    """
    import shlex

    drfc = request.installation.open()
    if drfc.local_is_s3:
        folder = shlex.quote(str(drfc.path))
        progress(f"- what this machine has of it; `racecraft bucket list --folder {folder}` asks the bucket itself")
    words = [word for word in request.args if not word.startswith("--")]
    recursive = "--recursive" in request.args
    if words[:2] == ["s3", "ls"] and len(words) <= 3:
        return _listed(drfc, words[2] if len(words) == 3 else f"s3://{drfc.bucket.name}/", recursive)
    if words[:2] == ["s3", "cp"] and len(words) == 4:
        source = _path(drfc, words[2])
        return CopiedObject(source, copy_files(source, _path(drfc, words[3]), recursive))
    raise SettingError(
        "'{args}' is not understood; expected s3 ls [s3://…] or s3 cp FROM TO. "
        "The bucket is the folder {bucket}: cp, ls and rm work there.",
        args=" ".join(request.args),
        bucket=drfc.bucket,
    )


def _path(drfc: DrfcFolder, text: str) -> Path:
    if not text.startswith("s3://"):
        return Path(text)
    bucket, _, key = text.removeprefix("s3://").rstrip("/").partition("/")
    return drfc.in_bucket(text.rstrip("/")) if key else drfc.in_bucket(f"s3://{bucket}/-").parent


def _listed(drfc: DrfcFolder, text: str, recursive: bool) -> LocalObjects:
    root = _path(drfc, text)
    if not root.exists():
        raise UserInputError("{text}: there is nothing; expected a prefix of {bucket}.", text=text, bucket=drfc.bucket)
    found = [root] if root.is_file() else sorted(root.rglob("*") if recursive else root.iterdir())
    return LocalObjects([
        LocalObject(
            str(path.relative_to(root)) if root.is_dir() else path.name,
            path.is_dir(), path.stat().st_size, path.stat().st_mtime,
        )
        for path in found
        if not (recursive and path.is_dir())
    ])  # fmt: skip

"""`dr-local-aws`: the few words of `aws s3` that racers say to the local bucket, said to its folder."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from racecraft.cli.output import word
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.worlds.deepracer.actions.drfc.copying import copy_files
from racecraft.worlds.deepracer.cli.dr.context import installation

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

WORDS = {"allow_extra_args": True, "ignore_unknown_options": True}


def local_aws(context: typer.Context) -> None:
    """Say `s3 ls` or `s3 cp` to the local bucket; it is a folder, so every other program can look into it as well.

    Examples:

        racecraft dr local-aws s3 ls s3://bucket/rl-deepracer-sagemaker/

        racecraft dr local-aws s3 cp s3://bucket/custom_files/reward_function.py .
    """
    drfc = installation(context)
    if drfc.local_is_s3:
        print(
            f"- what this machine has of it; `racecraft bucket list --folder {word(drfc.path)}` asks the bucket itself"
        )
    words = [word for word in context.args if not word.startswith("--")]
    recursive = "--recursive" in context.args
    if words[:2] == ["s3", "ls"] and len(words) <= 3:
        _list(drfc, words[2] if len(words) == 3 else f"s3://{drfc.bucket.name}/", recursive)
    elif words[:2] == ["s3", "cp"] and len(words) == 4:
        source = _place(drfc, words[2])
        print(f"copied {source} to {copy_files(source, _place(drfc, words[3]), recursive)}")
    else:
        raise SettingError(
            "'{args}' is not understood; expected s3 ls [s3://…] or s3 cp FROM TO. "
            "The bucket is the folder {bucket}: cp, ls and rm work there.",
            args=" ".join(context.args),
            bucket=drfc.bucket,
        )


def _place(drfc: DrfcFolder, text: str) -> Path:
    if not text.startswith("s3://"):
        return Path(text)
    bucket, _, key = text.removeprefix("s3://").rstrip("/").partition("/")
    return drfc.in_bucket(text.rstrip("/")) if key else drfc.in_bucket(f"s3://{bucket}/-").parent


def _list(drfc: DrfcFolder, text: str, recursive: bool) -> None:
    place = _place(drfc, text)
    if not place.exists():
        raise UserInputError("{text}: there is nothing; expected a prefix of {bucket}.", text=text, bucket=drfc.bucket)
    found = [place] if place.is_file() else sorted(place.rglob("*") if recursive else place.iterdir())
    for path in found:
        if path.is_dir():
            if not recursive:
                print(f"{'PRE':>30} {path.name}/")
            continue
        when = datetime.datetime.fromtimestamp(path.stat().st_mtime).strftime("%Y-%m-%d %H:%M:%S")
        name = path.relative_to(place) if place.is_dir() else path.name
        print(f"{when} {path.stat().st_size:>10} {name}")

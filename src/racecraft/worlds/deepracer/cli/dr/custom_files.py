"""`dr-upload-custom-files`, `dr-download-custom-files`: the racer's files to the bucket, and back."""

from __future__ import annotations

import typer

from racecraft.worlds.deepracer.actions.drfc.custom_files import copy_changed
from racecraft.worlds.deepracer.actions.drfc.sync import fetch_custom_files, send_custom_files
from racecraft.worlds.deepracer.cli.dr.context import SHOWN, installation, say_notes


def upload_custom_files(context: typer.Context) -> None:
    """Copy custom_files into the bucket, where a training reads them.

    Example: racecraft dr upload-custom-files
    """
    drfc = installation(context)
    say_notes(drfc)
    copy_changed(
        drfc.custom_files,
        drfc.custom_prefix,
        "Put reward_function.py and the two JSON files there.",
        SHOWN,
    )
    send_custom_files(drfc, SHOWN)


def download_custom_files(context: typer.Context) -> None:
    """Copy the files of the bucket over those in custom_files; of one that differs a copy is kept as FILE.bak.

    Example: racecraft dr download-custom-files
    """
    drfc = installation(context)
    say_notes(drfc)
    fetch_custom_files(drfc, SHOWN)
    copy_changed(
        drfc.custom_prefix, drfc.custom_files, "dr-upload-custom-files copies custom_files there.", SHOWN, keeps=True
    )

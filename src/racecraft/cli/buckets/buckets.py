"""`racecraft bucket`: folders up to a bucket and down from it, what is in it, and a folder served as one."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from typing import TYPE_CHECKING

import typer

from racecraft.actions.buckets import Link, Listing, Transferred, link, list_bucket, pull, push
from racecraft.actions.serve_buckets import ServedBuckets, serve_buckets
from racecraft.cli.from_request import command

if TYPE_CHECKING:
    from racecraft.storage.object_store import StoredObject

KEY, SECRET = "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"

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
    for name, size in sorted(found.items()):
        top, slash, _ = name.partition("/")
        if slash and not recursive:
            folders.add(top)
            continue
        when = datetime.datetime.fromtimestamp(size.modified).strftime("%Y-%m-%d %H:%M:%S")
        lines.append(f"{when} {size.size:>10} {name}")
    return [f"{'PRE':>30} {name}/" for name in sorted(folders)] + lines


app.command("push")(command(push, _show_transfer))
app.command("pull")(command(pull, _show_transfer))
app.command("list")(command(list_bucket, _show_listing))
app.command("link")(command(link, _show_link))


def _show_served(served: ServedBuckets) -> None:
    for name, path in served.folders.items():
        print(f"s3://{name}/ is {path}")
    print(f"{served.url}  (Ctrl-C ends)\n  export AWS_ENDPOINT_URL={served.url}")
    print(f"  export {KEY}={served.key.key}\n  export {SECRET}={served.key.secret}", flush=True)


app.command("serve")(command(serve_buckets, _show_served))

"""What each request of S3 that is understood is answered with. Begin with `answer`.

    GET  /                                   the buckets
    HEAD /B · GET /B?location                whether a bucket stands
    GET  /B[?list-type=2]                    its objects, a page of them
    GET, HEAD, PUT, DELETE /B/KEY            an object; PUT with x-amz-copy-source copies one
    POST /B?delete                           many objects away
    GET  /B?uploads · GET /B/KEY?uploadId    uploads in parts, and the parts that have arrived
    POST /B/KEY?uploads · PUT ?partNumber · POST ?uploadId · DELETE ?uploadId

Buckets are folders somebody named, so none is made or taken away. Whatever else S3 has is answered NotImplemented.
"""

from __future__ import annotations

import base64
import binascii
import mimetypes
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

from racecraft.serving.buckets.bucket_folder import BucketFolder, FileObject
from racecraft.serving.buckets.listing import list_objects
from racecraft.serving.buckets.uploads import Uploads
from racecraft.serving.buckets.xml import (
    S3Error,
    children,
    document,
    element,
    group,
    http_time,
    iso_time,
    parsed,
    text_of,
)

MOST_XML_BYTES = 2 * 2**20
OWNER = group("Owner", element("ID", "racecraft"), element("DisplayName", "racecraft"))
_UNKNOWN = (
    "acl", "policy", "tagging", "versioning", "versions", "cors", "lifecycle", "website", "logging", "notification",
    "replication", "encryption", "retention", "legal-hold", "object-lock", "select", "restore", "torrent", "accelerate",
    "requestPayment", "publicAccessBlock", "ownershipControls", "policyStatus", "attributes", "inventory", "metrics",
)  # fmt: skip


@dataclass(frozen=True)
class Asked:
    """A request."""

    method: str
    bucket: str
    key: str
    query: Mapping[str, str]
    headers: Mapping[str, str]
    """Names in small letters."""
    pieces: Iterator[bytes]
    """The body."""

    def text(self) -> bytes:
        """Return a body of XML, whole."""
        found = b""
        for piece in self.pieces:
            found += piece
            if len(found) > MOST_XML_BYTES:
                raise S3Error(400, "MalformedXML", f"The body has more than {MOST_XML_BYTES} bytes.")
        return found

    @property
    def md5(self) -> str:
        """Digest that the body must have, in hexadecimal digits; empty where none is told."""
        told = self.headers.get("content-md5", "")
        try:
            return base64.b64decode(told, validate=True).hex()
        except (binascii.Error, ValueError):
            raise S3Error(400, "InvalidDigest", f"Content-MD5 is {told[:40]!r}.") from None


@dataclass(frozen=True)
class Answer:
    """What is sent back."""

    status: int = 200
    body: bytes = b""
    headers: Mapping[str, str] = field(default_factory=dict)
    file: Path | None = None
    """A file of which bytes are sent, instead of a body."""
    begin: int = 0
    length: int | None = None
    """Bytes of the file, or those that a body would have had (HEAD)."""


def answer(buckets: Mapping[str, BucketFolder], asked: Asked) -> Answer:
    """Answer a request.

    Raises:
        S3Error: It is refused.
    """
    if not asked.bucket:
        if asked.method not in ("GET", "HEAD"):
            raise S3Error(405, "MethodNotAllowed", "Here stand the buckets: GET.")
        return _xml(
            document("ListAllMyBucketsResult", OWNER, group("Buckets", *map(_bucket_element, buckets.values())))
        )
    bucket = buckets.get(asked.bucket)
    if bucket is None and asked.method == "PUT" and not asked.key:
        raise S3Error(501, "NotImplemented", f"Buckets are folders that were named: {', '.join(buckets)}.")
    if bucket is None:
        raise S3Error(404, "NoSuchBucket", f"There is no bucket {asked.bucket!r}; there are {', '.join(buckets)}.")
    for word in _UNKNOWN:
        if word in asked.query:
            raise S3Error(501, "NotImplemented", f"A bucket that is a folder has no {word}.")
    if not asked.key:
        return _of_bucket(bucket, asked)
    return _of_object(buckets, bucket, asked)


def _of_bucket(bucket: BucketFolder, asked: Asked) -> Answer:
    if asked.method == "HEAD":
        return Answer()
    if asked.method == "PUT":
        raise S3Error(409, "BucketAlreadyOwnedByYou", f"The bucket {bucket.name!r} stands already.")
    if asked.method == "POST" and "delete" in asked.query:
        return _delete_many(bucket, asked)
    if asked.method != "GET":
        raise S3Error(501, "NotImplemented", "Buckets are folders that were named: none is made or taken away.")
    if "location" in asked.query:
        return _xml(document("LocationConstraint"))
    if "uploads" in asked.query:
        return _uploads(bucket, asked)
    return _xml(list_objects(bucket, asked.query))


def _of_object(buckets: Mapping[str, BucketFolder], bucket: BucketFolder, asked: Asked) -> Answer:
    uploads, upload = Uploads(bucket), asked.query.get("uploadId")
    if asked.method == "POST" and "uploads" in asked.query:
        named = element("UploadId", uploads.begin(asked.key))
        return _xml(document("InitiateMultipartUploadResult", *_place(bucket, asked.key), named))
    if upload is not None:
        return _of_upload(buckets, bucket, asked, uploads, upload)
    acts: dict[str, Callable[[], Answer]] = {
        "GET": lambda: _get(bucket, asked, whole=True),
        "HEAD": lambda: _get(bucket, asked, whole=False),
        "PUT": lambda: _put(buckets, bucket, asked),
        "DELETE": lambda: _delete(bucket, asked.key),
    }
    if asked.method not in acts:
        raise S3Error(501, "NotImplemented", f"{asked.method} of an object is not understood.")
    return acts[asked.method]()


def _of_upload(
    buckets: Mapping[str, BucketFolder], bucket: BucketFolder, asked: Asked, uploads: Uploads, upload: str
) -> Answer:
    key = asked.key
    if asked.method == "PUT":
        number = asked.query.get("partNumber", "")
        if "x-amz-copy-source" in asked.headers:
            source, begin, length = _copied(buckets, asked)
            etag = uploads.write_part(upload, key, _whole(number), _file_pieces(source.path, begin, length), "")
            return _xml(_copy_result("CopyPartResult", etag, source.modified))
        etag = uploads.write_part(upload, key, _whole(number), asked.pieces, asked.md5)
        return Answer(headers={"ETag": f'"{etag}"'})
    if asked.method == "POST":
        listed = [
            (_whole(text_of(part, "PartNumber")), text_of(part, "ETag").strip('"'))
            for part in children(parsed(asked.text()), "Part")
        ]
        etag = uploads.complete(upload, key, listed)
        return _xml(document("CompleteMultipartUploadResult", *_place(bucket, key), element("ETag", f'"{etag}"')))
    if asked.method == "DELETE":
        uploads.abort(upload, key)
        return Answer(204)
    parts = [
        group("Part", element("PartNumber", part.number), element("ETag", f'"{part.etag}"'), element("Size", part.size))
        for part in uploads.parts(upload, key)
    ]
    head = (*_place(bucket, key), element("UploadId", upload), element("IsTruncated", False))
    return _xml(document("ListPartsResult", *head, *parts))


def _uploads(bucket: BucketFolder, asked: Asked) -> Answer:
    listed = [
        group(
            "Upload",
            element("Key", upload.key),
            element("UploadId", upload.name),
            element("Initiated", iso_time(upload.begun)),
        )
        for upload in Uploads(bucket).all(asked.query.get("prefix", ""))
    ]
    return _xml(
        document("ListMultipartUploadsResult", element("Bucket", bucket.name), element("IsTruncated", False), *listed)
    )


def _get(bucket: BucketFolder, asked: Asked, whole: bool) -> Answer:
    found = bucket.find(asked.key)
    if found is None:
        if bucket.is_folder(asked.key):  # what the console lays where a folder is to be seen
            return Answer(headers={"ETag": '"d41d8cd98f00b204e9800998ecf8427e"'})
        raise S3Error(404, "NoSuchKey", f"There is no object {asked.key!r}.")
    told, etag = asked.headers, f'"{found.etag}"'
    if told.get("if-match", etag) not in (etag, "*", found.etag):
        raise S3Error(412, "PreconditionFailed", "The object is another one now.")
    headers = {
        "ETag": etag,
        "Last-Modified": http_time(found.modified),
        "Accept-Ranges": "bytes",
        "Content-Type": asked.query.get("response-content-type") or _kind(found.path),
    }
    if told.get("if-none-match") in (etag, "*", found.etag):
        return Answer(304, headers=headers)
    begin, length, ranged = _range(told.get("range", ""), found.size)
    if ranged:
        headers["Content-Range"] = f"bytes {begin}-{begin + length - 1}/{found.size}"
    return Answer(
        206 if ranged else 200, headers=headers, file=found.path if whole else None, begin=begin, length=length
    )


def _put(buckets: Mapping[str, BucketFolder], bucket: BucketFolder, asked: Asked) -> Answer:
    key = asked.key
    if "x-amz-copy-source" in asked.headers:
        source, begin, length = _copied(buckets, asked)
        if source.path == bucket.path / key:
            etag = source.etag
        else:
            etag = bucket.write(key, _file_pieces(source.path, begin, length))
        made = bucket.find(key)
        return _xml(_copy_result("CopyObjectResult", etag, made.modified if made else source.modified))
    if asked.headers.get("if-none-match") == "*" and bucket.find(key) is not None:
        raise S3Error(412, "PreconditionFailed", f"There is an object {key!r} already.")
    if key.endswith("/"):
        if any(asked.pieces):
            raise S3Error(400, "InvalidArgument", "A key that ends with a slash is a folder, and holds no bytes here.")
        bucket.make_folder(key)
        return Answer(headers={"ETag": '"d41d8cd98f00b204e9800998ecf8427e"'})
    return Answer(headers={"ETag": f'"{bucket.write(key, asked.pieces, asked.md5)}"'})


def _delete(bucket: BucketFolder, key: str) -> Answer:
    bucket.remove(key)
    return Answer(204)


def _delete_many(bucket: BucketFolder, asked: Asked) -> Answer:
    root = parsed(asked.text())
    quiet = text_of(root, "Quiet") == "true"
    results = []
    for one in children(root, "Object"):
        key = text_of(one, "Key")
        try:
            bucket.remove(key)
        except S3Error as error:
            told = element("Key", key), element("Code", error.code), element("Message", error.letter)
            results.append(group("Error", *told))
        else:
            results += [] if quiet else [group("Deleted", element("Key", key))]
    return _xml(document("DeleteResult", *results))


def _copied(buckets: Mapping[str, BucketFolder], asked: Asked) -> tuple[FileObject, int, int]:
    """Return the object that is to be copied, and which of its bytes."""
    named = unquote(asked.headers["x-amz-copy-source"].partition("?")[0]).lstrip("/")
    bucket, _, key = named.partition("/")
    found = buckets[bucket].find(key) if bucket in buckets else None
    if found is None:
        raise S3Error(404, "NoSuchKey", f"There is no object {named!r} to copy.")
    begin, length, _ = _range(asked.headers.get("x-amz-copy-source-range", ""), found.size)
    return found, begin, length


def _copy_result(name: str, etag: str, modified: float) -> bytes:
    return document(name, element("ETag", f'"{etag}"'), element("LastModified", iso_time(modified)))


def _range(text: str, size: int) -> tuple[int, int, bool]:
    """Return where to begin, how many bytes, and whether a part was asked for."""
    unit, _, span = text.partition("=")
    first, dash, last = span.partition("-")
    if unit.strip() != "bytes" or not dash or "," in span or not (first + last).isdecimal():
        return 0, size, False
    if not first:
        begin, end = max(0, size - int(last)), size
    else:
        begin, end = int(first), min(int(last) + 1, size) if last else size
    if begin >= end:
        raise S3Error(416, "InvalidRange", f"The object has {size} bytes; {text} are none of them.")
    return begin, end - begin, True


def _file_pieces(path: Path, begin: int, length: int) -> Iterator[bytes]:
    with open(path, "rb") as file:
        file.seek(begin)
        while length > 0 and (block := file.read(min(1 << 20, length))):
            length -= len(block)
            yield block


def _whole(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 7):
        raise S3Error(400, "InvalidArgument", f"{text[:40]!r}: expected the number of a part.")
    return int(text)


def _kind(path: Path) -> str:
    return mimetypes.guess_type(path.name)[0] or "application/octet-stream"


def _place(bucket: BucketFolder, key: str) -> tuple[str, str]:
    return element("Bucket", bucket.name), element("Key", key)


def _bucket_element(bucket: BucketFolder) -> str:
    made = element("CreationDate", iso_time(bucket.path.stat().st_mtime))
    return group("Bucket", element("Name", bucket.name), made)


def _xml(body: bytes) -> Answer:
    return Answer(body=body, headers={"Content-Type": "application/xml"})

"""A page of a bucket's objects, as ListObjectsV2 and its older version want it. See `list_objects`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from urllib.parse import quote

from racecraft.serving.buckets.bucket_folder import BucketFolder
from racecraft.serving.buckets.xml import S3Error, document, element, group, iso_time

MOST_KEYS = 1000


def list_objects(bucket: BucketFolder, query: Mapping[str, str]) -> bytes:
    """Return the page that is asked for: objects, and what stands for those behind a delimiter.

    Raises:
        S3Error: A number is none.
    """
    second = query.get("list-type") == "2"
    prefix, delimiter = query.get("prefix", ""), query.get("delimiter", "")
    after = query.get("continuation-token") or query.get("start-after", "") if second else query.get("marker", "")
    most = _most(query.get("max-keys", str(MOST_KEYS)))
    page, truncated, last = _page(bucket, prefix, delimiter, after or "", most)
    told = _as_asked(query)
    parts = [element("Name", bucket.name), element("Prefix", told(prefix)), element("MaxKeys", most)]
    parts += [element("Delimiter", told(delimiter))] if delimiter else []
    parts += [element("EncodingType", "url")] if query.get("encoding-type") == "url" else []
    parts.append(element("IsTruncated", truncated))
    if second:
        parts.append(element("KeyCount", len(page)))
        parts += [element("NextContinuationToken", last)] if truncated else []
        parts += [element("ContinuationToken", after)] if query.get("continuation-token") else []
    else:
        parts.append(element("Marker", told(after or "")))
        parts += [element("NextMarker", told(last))] if truncated else []
    for name, is_prefix in page:
        if is_prefix:
            parts.append(group("CommonPrefixes", element("Prefix", told(name))))
        elif (found := bucket.find(name)) is not None:  # else it was taken away just now
            facts = element("LastModified", iso_time(found.modified)), element("ETag", f'"{found.etag}"')
            rest = element("Size", found.size), element("StorageClass", "STANDARD")
            parts.append(group("Contents", element("Key", told(name)), *facts, *rest))
    return document("ListBucketResult", *parts)


def _page(
    bucket: BucketFolder, prefix: str, delimiter: str, after: str, most: int
) -> tuple[list[tuple[str, bool]], bool, str]:
    """Return names and whether each is a common prefix, whether there are more, and the last name."""
    page: list[tuple[str, bool]] = []
    for name, is_prefix in _names(bucket, prefix, delimiter):
        if name.encode("utf-8", "surrogateescape") <= after.encode("utf-8", "surrogateescape"):
            continue
        if len(page) == most:
            return page, most > 0, page[-1][0] if page else ""
        page.append((name, is_prefix))
    return page, False, page[-1][0] if page else ""


def _names(bucket: BucketFolder, prefix: str, delimiter: str) -> Iterator[tuple[str, bool]]:
    common = ""
    for key in bucket.keys(prefix):
        at = key.find(delimiter, len(prefix)) if delimiter else -1
        if at < 0:
            yield key, False
        elif key[: at + len(delimiter)] != common:
            common = key[: at + len(delimiter)]
            yield common, True


def _as_asked(query: Mapping[str, str]) -> Callable[[str], str]:
    if query.get("encoding-type") == "url":
        return lambda text: quote(text, safe="/")
    return lambda text: text


def _most(text: str) -> int:
    if not (text.isascii() and text.isdigit()):
        raise S3Error(400, "InvalidArgument", f"max-keys is {text[:40]!r}; expected a number.")
    return min(int(text[:9]), MOST_KEYS)

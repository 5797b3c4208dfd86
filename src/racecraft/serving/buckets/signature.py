"""Who asks: AWS's signature, version 4, in the head of a request or in its address. See `require_signed`.

Source: AWS's documentation of Signature Version 4 ("Authenticating Requests"): canonical request, string to sign, key.
"""

from __future__ import annotations

import datetime
import hashlib
import hmac
from collections.abc import Mapping, Sequence
from urllib.parse import quote

from racecraft.serving.buckets.xml import S3Error

ALGORITHM = "AWS4-HMAC-SHA256"
MOST_SKEW_SECONDS = 15 * 60
"""How far the clock of who asks may be off."""


def require_signed(
    method: str,
    path: str,
    query: Sequence[tuple[str, str]],
    headers: Mapping[str, str],
    keys: Mapping[str, str],
    now: datetime.datetime,
) -> None:
    """Refuse a request that nobody signed whose keys are known.

    Args:
        method: As it was sent.
        path: As it was sent, quoted.
        query: Names and values, unquoted, in any order.
        headers: Names in small letters.
        keys: Secrets by the name of their key.
        now: The moment, in UTC.

    Raises:
        S3Error: It is not signed, by an unknown key, wrongly, or too long ago.
    """
    asked = dict(query)
    if asked.get("X-Amz-Algorithm") == ALGORITHM:
        credential, signed = asked.get("X-Amz-Credential", ""), asked.get("X-Amz-SignedHeaders", "")
        signature, stamp = asked.get("X-Amz-Signature", ""), asked.get("X-Amz-Date", "")
        lasts = int(asked["X-Amz-Expires"]) if asked.get("X-Amz-Expires", "").isdecimal() else 0
        query = [(name, value) for name, value in query if name != "X-Amz-Signature"]
        payload = "UNSIGNED-PAYLOAD"
    else:
        credential, signed, signature = _authorization(headers.get("authorization", ""))
        stamp, lasts = headers.get("x-amz-date", ""), MOST_SKEW_SECONDS
        payload = headers.get("x-amz-content-sha256", "UNSIGNED-PAYLOAD")
    key, *scope = credential.split("/")
    if key not in keys:
        raise S3Error(403, "InvalidAccessKeyId", f"The key {key[:40]!r} is not known here.")
    _require_recent(stamp, lasts, now)
    told = "".join(f"{name}:{' '.join(headers.get(name, '').split())}\n" for name in signed.split(";"))
    pairs = sorted((quote(name, safe="-_.~"), quote(value, safe="-_.~")) for name, value in query)
    line = "&".join(f"{name}={value}" for name, value in pairs)
    request = "\n".join((method, path, line, told, signed, payload))
    text = "\n".join((ALGORITHM, stamp, "/".join(scope), hashlib.sha256(request.encode()).hexdigest()))
    if not hmac.compare_digest(_signature(keys[key], scope, text), signature):
        raise S3Error(403, "SignatureDoesNotMatch", "The signature is not the one that this key makes.")


def _authorization(text: str) -> tuple[str, str, str]:
    kind, _, rest = text.partition(" ")
    parts = dict(part.strip().partition("=")[::2] for part in rest.split(","))
    if kind != ALGORITHM or not {"Credential", "SignedHeaders", "Signature"} <= set(parts):
        raise S3Error(403, "AccessDenied", f"The request is not signed; expected {ALGORITHM}.")
    return parts["Credential"], parts["SignedHeaders"], parts["Signature"]


def _require_recent(stamp: str, lasts: int, now: datetime.datetime) -> None:
    try:
        signed_at = datetime.datetime.strptime(stamp, "%Y%m%dT%H%M%SZ").replace(tzinfo=datetime.UTC)
    except ValueError:
        raise S3Error(403, "AccessDenied", "The request does not say when it was signed.") from None
    age = (now - signed_at).total_seconds()
    if not -MOST_SKEW_SECONDS <= age <= lasts:
        raise S3Error(403, "RequestTimeTooSkewed", f"The request was signed {age:.0f} s ago; look at the clock.")


def _signature(secret: str, scope: Sequence[str], text: str) -> str:
    key = f"AWS4{secret}".encode()
    for part in scope:
        key = hmac.new(key, part.encode(), hashlib.sha256).digest()
    return hmac.new(key, text.encode(), hashlib.sha256).hexdigest()

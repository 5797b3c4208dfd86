"""Where a bucket is, and who asks for it. See `S3Connection` and `access_of_environment`.

What is not said here is found by botocore as everywhere else: AWS_PROFILE, AWS_ACCESS_KEY_ID, the files below ~/.aws,
the role of the machine.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from racecraft.storage.address import BucketError

WHERE_KEYS_ARE = (
    "Keys are taken from a profile of ~/.aws (`aws configure` writes one; --profile and DR_LOCAL_S3_PROFILE name it), "
    "from AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or from DR_LOCAL_ACCESS_KEY_ID and DR_LOCAL_SECRET_ACCESS_KEY "
    "in system.env; racecraft itself keeps none, in mirror.json or elsewhere."
)
"""What a letter says of keys that are missing, wrong, or stand where they do not belong."""


@dataclass(frozen=True)
class S3Connection:
    """How a store is reached; what is empty is left to botocore."""

    endpoint: str = ""
    """Address of a store that is not AWS's, such as http://localhost:9000."""
    profile: str = ""
    """Profile of ~/.aws."""
    region: str = ""
    """Region of AWS."""
    key: str = field(default="", repr=False)
    """Name of a key of one's own."""
    secret: str = field(default="", repr=False)
    """What belongs to it. Neither is ever printed or written down."""

    def __post_init__(self) -> None:
        """Refuse an endpoint that is no address."""
        if self.endpoint:
            require_endpoint(self.endpoint, "endpoint")
        if bool(self.key) != bool(self.secret):
            raise BucketError("one half of a pair of keys is given; expected both, or none.")

    @property
    def options_text(self) -> str:
        """How a command is told the same, with a blank before it: " --endpoint-url … --profile …"."""
        named = (("--endpoint-url", self.endpoint), ("--profile", self.profile), ("--region", self.region))
        return "".join(f" {option} {value}" for option, value in named if value)


def require_endpoint(text: str, named: str) -> str:
    """Return an endpoint's address.

    Args:
        text: What was written.
        named: What it was written as, for the letter.

    Raises:
        BucketError: It is none, or holds keys: an endpoint is printed and noted, and keys never are.
    """
    try:
        parts = urlsplit(text)
        if "@" in parts.netloc:
            raise BucketError(
                "{named}: it holds the keys before its '@', which would be printed and written down; expected the "
                "address alone, {scheme}://{rpartition}. {where_keys_are}",
                named=named,
                scheme=parts.scheme,
                rpartition=parts.netloc.rpartition("@")[2],
                where_keys_are=WHERE_KEYS_ARE,
            )
        usable = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:  # of a port
        usable = False
    if not usable:
        raise BucketError(
            "{named} {text!r}: is no address of a store; expected one such as http://localhost:9000.",
            named=named,
            text=text,
        )
    return text


def access_of_environment(
    endpoint: str = "", profile: str = "", region: str = "", environment: Mapping[str, str] = os.environ
) -> S3Connection:
    """Return how a store is reached where a command is told, and else the environment.

    Args:
        endpoint: As typed; else AWS_ENDPOINT_URL_S3, then AWS_ENDPOINT_URL.
        profile: As typed; else AWS_PROFILE, which botocore reads.
        region: As typed; else AWS_REGION or AWS_DEFAULT_REGION.
        environment: The variables.

    Raises:
        BucketError: An endpoint is none.
    """
    for name in ("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"):
        if not endpoint and environment.get(name):
            endpoint = require_endpoint(environment[name], name)
    region = region or environment.get("AWS_REGION", "") or environment.get("AWS_DEFAULT_REGION", "")
    return S3Connection(endpoint=endpoint, profile=profile, region=region)

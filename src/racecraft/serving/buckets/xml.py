"""What S3 says in XML, and its errors. See `element` and `S3Error`."""

from __future__ import annotations

import datetime
from email.utils import formatdate
from xml.etree import ElementTree
from xml.sax.saxutils import escape

NAMESPACE = "http://s3.amazonaws.com/doc/2006-03-01/"


class S3Error(Exception):
    """A request that is answered with an error.

    Args:
        status: HTTP status.
        code: S3's word for it, which clients look at.
        letter: A sentence for people.
    """

    def __init__(self, status: int, code: str, letter: str) -> None:
        super().__init__(letter)
        self.status, self.code, self.letter = status, code, letter

    def body(self, resource: str) -> bytes:
        """Return it as S3 says it."""
        parts = element("Code", self.code), element("Message", self.letter), element("Resource", resource)
        return document("Error", *parts, namespace="")


def element(name: str, content: str | int | bool) -> str:
    """Return an element that holds a text.

    >>> element("Key", "a<b"), element("IsTruncated", False)
    ('<Key>a&lt;b</Key>', '<IsTruncated>false</IsTruncated>')
    """
    text = ("true" if content else "false") if isinstance(content, bool) else str(content)
    return f"<{name}>{escape(text)}</{name}>"


def group(name: str, *parts: str) -> str:
    """Return an element that holds elements."""
    return f"<{name}>{''.join(parts)}</{name}>"


def document(name: str, *parts: str, namespace: str = NAMESPACE) -> bytes:
    """Return a whole document."""
    named = f'<{name} xmlns="{namespace}">' if namespace else f"<{name}>"
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{named}{"".join(parts)}</{name}>'.encode()


def parsed(body: bytes) -> ElementTree.Element:
    """Read a document that was sent; it may declare nothing, so nothing in it can grow.

    Raises:
        S3Error: It is none.
    """
    if b"<!" in body:
        raise S3Error(400, "MalformedXML", "The XML declares something; expected elements only.")
    try:
        return ElementTree.fromstring(body)
    except (ElementTree.ParseError, ValueError) as error:
        raise S3Error(400, "MalformedXML", f"This is no XML: {error}.") from None


def children(root: ElementTree.Element, name: str) -> list[ElementTree.Element]:
    """Return the elements of a name right below another, whatever their namespace."""
    return [one for one in root if one.tag.rpartition("}")[2] == name]


def text_of(root: ElementTree.Element, name: str) -> str:
    """Return the text of the first element of a name; empty where there is none."""
    found = children(root, name)
    return (found[0].text or "") if found else ""


def iso_time(seconds: float) -> str:
    """Return a moment as S3's XML says it.

    >>> iso_time(0.0)
    '1970-01-01T00:00:00.000Z'
    """
    moment = datetime.datetime.fromtimestamp(seconds, datetime.UTC)
    return moment.strftime("%Y-%m-%dT%H:%M:%S.") + f"{moment.microsecond // 1000:03d}Z"


def http_time(seconds: float) -> str:
    """Return a moment as HTTP says it."""
    return formatdate(seconds, usegmt=True)

"""A model that is being made: what was typed until now, as a file that outlives browser and console. See `Drafts`."""

from __future__ import annotations

import json
import re
import secrets
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import UserInputError
from racecraft.formats.atomic import make_folder, write_atomic

FORMAT, VERSION = "racecraft draft", 1
LEGAL_ID = re.compile(r"[a-z0-9]{8}")
MAX_BYTES = 2**20


class DraftError(UserInputError):
    """There is no such draft."""


class DraftChangedError(UserInputError):
    """Another page changed a draft since the form was loaded.

    Args:
        others: What that page typed into the fields in which both differ.
    """

    def __init__(self, others: Mapping[str, Any]) -> None:
        super().__init__("This draft was changed elsewhere: {fields}.", fields=", ".join(sorted(others)))
        self.others = others


@dataclass(frozen=True, kw_only=True)
class Draft:
    """A model that is being made."""

    id: str
    kind: str
    name: str
    """Of the model."""
    typed: Mapping[str, Any]
    """By field; what was never touched is missing."""
    base: Mapping[str, Any]
    """What the fields were in the model that is cloned; {}: none is."""
    cloned_from: str = ""
    """The model that is cloned; "": none."""
    in_place: bool = False
    """Whether that model goes on itself, changed; its name stays."""
    edits: int = 0
    """Counts the changes; a form that began from another count is told."""
    writer: str = ""
    """The page that changed it last: its own changes are no surprise to it."""
    changed: float = 0.0
    """Seconds since 1970."""


class Drafts:
    """The drafts of a workspace.

    Args:
        folder: Where they are.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def begin(
        self,
        kind: str,
        name: str,
        base: Mapping[str, Any] | None = None,
        cloned_from: str = "",
        typed: Mapping[str, Any] | None = None,
        in_place: bool = False,
    ) -> Draft:
        """Return a new draft.

        Args:
            kind: The world.
            name: Of the model.
            base: Values of the model that is cloned.
            cloned_from: That model.
            typed: Values that are chosen already.
            in_place: Whether the model that is cloned goes on itself.

        Raises:
            OutputFileError: The folder cannot be written.
        """
        known = dict(base or {})
        draft = Draft(
            id=secrets.token_hex(4),
            kind=kind,
            name=name,
            typed=known | dict(typed or {}),
            base=known,
            cloned_from=cloned_from,
            in_place=in_place,
        )
        return self._write(draft)

    def find(self, key: str) -> Draft:
        """Return the draft of an id.

        Raises:
            DraftError: There is none, or its file is damaged.
        """
        try:
            draft = json.loads(self._path(key).read_text(encoding="utf-8"))
            known = {name: draft[name] for name in Draft.__dataclass_fields__ if name in draft}
            return Draft(**known)
        except (OSError, ValueError, KeyError, TypeError):
            raise DraftError("There is no draft {key!r}; begin a new model.", key=key[:20]) from None

    def keep(self, draft: Draft, edits: int, writer: str, name: str, typed: Mapping[str, Any]) -> Draft:
        """Return a draft with what was typed in one of its steps.

        Args:
            draft: As it is now.
            edits: The count that the form began from.
            writer: The page that sends it; each time it is loaded it is another one.
            name: Of the model.
            typed: By field of that step.

        Raises:
            DraftChangedError: Another form changed one of these fields since.
        """
        if edits != draft.edits and writer != draft.writer:
            others = {
                field: draft.typed[field] for field in typed if draft.typed.get(field, typed[field]) != typed[field]
            }
            if others:
                raise DraftChangedError(others)
        changed = replace(draft, name=draft.name if draft.in_place else name[:64], typed={**draft.typed, **typed})
        return draft if changed == draft else self._write(replace(changed, edits=draft.edits + 1, writer=writer))

    def remove(self, draft: Draft) -> None:
        """Remove a draft whose model was made."""
        self._path(draft.id).unlink(missing_ok=True)

    def all(self) -> list[Draft]:
        """Return every draft, the latest first."""
        keys = [path.stem for path in self.folder.glob("*.json") if LEGAL_ID.fullmatch(path.stem)]
        return sorted((self.find(key) for key in keys), key=lambda draft: -draft.changed)

    def _write(self, draft: Draft) -> Draft:
        draft = replace(draft, changed=time.time())
        text = json.dumps({"format": FORMAT, "version": VERSION, **asdict(draft)}, indent=2) + "\n"
        if len(text) > MAX_BYTES:
            raise DraftError(
                "The draft is {count:,} bytes long; expected at most {most_bytes:,}.",
                count=len(text),
                most_bytes=MAX_BYTES,
            )
        make_folder(self.folder)
        write_atomic(self._path(draft.id), text)
        return draft

    def _path(self, key: str) -> Path:
        if not LEGAL_ID.fullmatch(key):
            raise DraftError("There is no draft {key!r}; begin a new model.", key=key[:20])
        return self.folder / f"{key}.json"

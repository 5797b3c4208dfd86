"""A result whose figures depend on what was asked. Begin with `Figures`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any


class Figures(Mapping[str, Any]):
    """Figures by name, as `--json` prints them; read only.

    >>> found = Figures({"laps": 3}, files={"page": "why.html"})
    >>> found["laps"], found["page"], dict(found)
    (3, 'why.html', {'laps': 3, 'page': 'why.html'})

    Args:
        figures: By name, with their unit in it.
        files: What was written, by kind; they are figures as well.
    """

    def __init__(self, figures: Mapping[str, Any], files: Mapping[str, Any] | None = None) -> None:
        self.files = MappingProxyType(dict(files or {}))
        self._figures = MappingProxyType({**figures, **self.files})

    def __getitem__(self, name: str) -> Any:
        return self._figures[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._figures)

    def __len__(self) -> int:
        return len(self._figures)

    def __repr__(self) -> str:
        return f"Figures({dict(self._figures)})"

    def as_dictionary(self) -> dict[str, Any]:
        """Return every figure by name."""
        return dict(self._figures)

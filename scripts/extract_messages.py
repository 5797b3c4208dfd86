"""Write the catalogue of every sentence that may be translated: `python scripts/extract_messages.py messages.pot`.

Errors and `Message`s of Python (their templates; of a file's errors what was found, what is expected, the hint),
what templates (`_("…")`) and modules of pages (`t("…")`) mark, and the texts of the lessons. A translator writes
LANGUAGE/LC_MESSAGES/racecraft.po from it, and `pybabel compile` makes the .mo that is read (src/racecraft/i18n).
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from babel.messages.catalog import Catalog
from babel.messages.extract import extract_from_file
from babel.messages.pofile import write_po

from racecraft.lessons.reading import messages

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "racecraft"
PLACED = {"InputFileError"}
"""Errors whose first argument is a path; the sentences follow."""
INSIDE_TOO = {"parse_template_string": True}
"""Calls inside JavaScript's template strings count as well."""
PASSED_ON = {"error_at", "refuse", "_refuse"}
"""Methods that take the words of an error: found, expected, hint."""


def main() -> int:
    """Write the catalogue to the named file."""
    if len(sys.argv) != 2:
        print(__doc__)
        return 2
    catalogue = collect()
    with Path(sys.argv[1]).open("wb") as file:
        write_po(file, catalogue, width=120, sort_by_file=True)
    print(f"{len(catalogue)} sentences in {sys.argv[1]}")
    return 0


def collect(source: Path = SOURCE) -> Catalog:
    """Return all sentences of a package, with the places where they stand."""
    catalogue = Catalog(project="racecraft")
    trees = {path: ast.parse(path.read_text("utf-8")) for path in sorted(source.rglob("*.py"))}
    bases = _bases(trees.values())
    kinds, placed = _derived(bases, "RacecraftError"), _derived(bases, *PLACED)
    for path, tree in trees.items():
        for line, text in _of_python(tree, kinds, placed):
            catalogue.add(text, locations=[(str(path.relative_to(source)), line)])
    for pattern, method, keywords in (
        ("**/*.html", "jinja2.ext:babel_extract", {"_": None}),
        ("**/*.js", "javascript", {"t": None}),
    ):
        for path in sorted(source.rglob(pattern)):
            if "vendor" not in path.parts:
                for line, text, *_ in extract_from_file(method, path, keywords=keywords, options=INSIDE_TOO):
                    catalogue.add(text, locations=[(str(path.relative_to(source)), line)])
    for path in sorted(source.rglob("lessons/texts/*.md")):
        for line, text in messages(path.read_text("utf-8"), path.name):
            catalogue.add(text, locations=[(str(path.relative_to(source)), line)])
    return catalogue


def _bases(trees: Iterable[ast.Module]) -> dict[str, set[str]]:
    bases: dict[str, set[str]] = {}
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                bases.setdefault(node.name, set()).update(_name(base) for base in node.bases)
    return bases


def _derived(bases: dict[str, set[str]], *roots: str) -> set[str]:
    found = set(roots)
    while more := {name for name, parents in bases.items() if parents & found} - found:
        found |= more
    return found


def _of_python(tree: ast.Module, kinds: set[str], placed: set[str]) -> Iterator[tuple[int, str]]:
    """Yield line and template of each sentence in a module."""
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        name = _name(call.func)
        if name in placed or (name == "error" and len(call.args) > 1):
            words: list[ast.expr] = [*call.args[1:], *(word.value for word in call.keywords)]
        elif name in PASSED_ON:
            words = [word.value for word in call.keywords if word.arg in ("found", "expected", "hint")]
        elif name in kinds or name == "Message":
            words = call.args[:1]
        else:
            continue
        for word in words:
            for constant in (word.body, word.orelse) if isinstance(word, ast.IfExp) else (word,):
                if isinstance(constant, ast.Constant) and isinstance(constant.value, str) and constant.value:
                    yield constant.lineno, constant.value


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


if __name__ == "__main__":
    sys.exit(main())

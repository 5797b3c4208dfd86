"""Errors and messages as data: templates with fields, translated where they are shown."""

import ast
import importlib.util
import pickle
import re
import string
from pathlib import Path

import pytest
from babel.messages.jslexer import tokenize

from racecraft.contract import message
from racecraft.contract.errors import InputFileError, SettingError, SeveralFaultsError
from racecraft.contract.message import Message
from racecraft.pages.render import render

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "racecraft"
FORMATTER = string.Formatter()


@pytest.fixture
def in_pseudo(tmp_path, monkeypatch):
    """Translate by a catalogue as a translator makes one, in which every known sentence stands in brackets."""
    from babel.messages.catalog import Catalog
    from babel.messages.mofile import write_mo

    catalogue = Catalog(locale="de")
    for text in ("{name} is {found}.", "{place}: {found}; expected {expected}.", "{count} rows", "a table"):
        catalogue.add(text, f"[{text}]")
    folder = tmp_path / "de" / "LC_MESSAGES"
    folder.mkdir(parents=True)
    with (folder / "racecraft.mo").open("wb") as file:
        write_mo(file, catalogue)
    monkeypatch.setattr(message, "CATALOGUES", tmp_path)
    monkeypatch.setenv("LANGUAGE", "de")
    message._catalogue.cache_clear()
    yield
    message._catalogue.cache_clear()


def test_a_page_names_its_language(in_pseudo):
    assert '<html lang="de"' in render("page.html", title="", sections=[])


def test_text_is_made_where_it_is_shown(in_pseudo):
    assert str(SettingError("{name} is {found}.", name="horizon", found=0)) == "[horizon is 0.]"
    error = InputFileError("a.csv", Message("{count} rows", count=2), "a table")
    assert str(error) == "[a.csv: [2 rows]; expected [a table].]"
    assert str(SettingError("nobody translated this")) == "nobody translated this"


def test_an_error_is_data():
    error = InputFileError("a.csv", Message("{count} rows", count=2), "a table", line=3, key="speed")
    data = error.as_data()
    assert data["kind"] == "InputFileError"
    assert data["message"] == "a.csv:3: speed: 2 rows; expected a table."
    assert {name: data["fields"][name] for name in ("path", "line", "key", "found")} == {
        "path": "a.csv", "line": 3, "key": "speed", "found": "2 rows",
    }  # fmt: skip
    both = SeveralFaultsError([error, SettingError("{name} is nan.", name=float("nan"))])
    assert [fault["kind"] for fault in both.as_data()["faults"]] == ["InputFileError", "SettingError"]
    assert both.as_data()["faults"][1]["fields"]["name"] is None


@pytest.mark.parametrize(
    "error",
    [
        SettingError("{name} is {found}.", name="horizon", found=0),
        InputFileError("a.csv", Message("{count} rows", count=2), "a table", "Mend it.", line=3),
        SeveralFaultsError([SettingError("first"), SettingError("second")]),
    ],
)
def test_errors_travel_between_processes(error):
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.as_data()) == (type(error), str(error), error.as_data())


def test_what_a_user_wrote_does_not_fill_the_screen():
    assert len(str(SettingError("{value} is no number.", value="9" * 100_000))) < 5_000
    assert len(str(InputFileError("a.json", Message("{value!r}", value="9" * 100_000), "a number"))) < 400
    assert str(SettingError("{value}", value="half \ud83d")).isascii()


def test_braces_of_a_text_without_fields_are_no_fields():
    assert str(SettingError('expected {"train": true}')) == 'expected {"train": true}'


def test_every_template_is_given_all_its_fields_and_no_other():
    wrong = []
    for path in SOURCE.rglob("*.py"):
        for call in (node for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Call)):
            name = getattr(call.func, "id", "")
            given = {word.arg for word in call.keywords}
            if (name != "Message" and not name.endswith("Error")) or not given or len(call.args) != 1 or None in given:
                continue
            template = call.args[0]
            is_text = isinstance(template, ast.Constant) and isinstance(template.value, str)
            if is_text and fields_of(template.value) != given:
                wrong.append(f"{path.relative_to(SOURCE)}:{call.lineno}")
    assert not wrong


def fields_of(template: str) -> set[str]:
    names = set()
    for _, name, spec, _ in FORMATTER.parse(template):
        if name is not None:
            names |= {name.split(".")[0].split("[")[0]} | fields_of(spec or "")
    return names


def test_the_catalogue_holds_the_sentences_of_errors():
    spec = importlib.util.spec_from_file_location("extract_messages", ROOT / "scripts" / "extract_messages.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    known = {entry.id for entry in script.collect() if entry.id}
    assert len(known) > 1000
    assert "PettingZoo is not installed; expected it for pettingzoo_parallel. Run: pip install pettingzoo" in known
    assert "{path}: holds no plot" not in known
    assert any(text.startswith("{name} has {num_worlds} worlds of {num_agents} agents") for text in known)


SENTENCE = re.compile(r"[A-Za-z]{2,}[,.:]? (~ )*[A-Za-z]{2,}|~[^ ]* [a-z]{2,}|[a-z]{2,} ~|^ ?[A-Z][a-z]+[.!?]?$")
"""Two words, or one beside a value, which is written as ~, or one with a capital letter."""
SHOWN = re.compile(r"(textContent|[.]title|ariaLabel|\"aria-label\"|[.]placeholder|\b(say|call|Option)[(].*) ?[=,:(]?$")
NOT_SHOWN = re.compile(
    r"[<=]|^[(]?[a-z-]+: |[~\d]px |translate[(]|color-mix|sans-serif|^(Enter|Escape|Files|True|False|Arrow~)$"
)
SELECTS = re.compile(r"(querySelector|querySelectorAll|closest) [(]$|class(Name)? [:=]$")
CLASSES = {"left name", "left quiet", "stop path"}


def unmarked(source):
    """Yield line and text of each literal of a module that a reader sees and that is not inside `t("…")`."""
    tokens = list(tokenize(source, template_string=True))
    for at, token in enumerate(tokens):
        before = [one.value for one in tokens[max(0, at - 2) : at]]
        if token.type not in ("string", "template_string") or before == ["t", "("] or SELECTS.search(" ".join(before)):
            continue
        text = re.sub(r"[$][{](?:[^{}]|[{][^{}]*[}])*[}]", "~", token.value[1:-1])
        shown = SHOWN.search(" ".join(before)) and re.search("[A-Za-z]{2}", text)
        if (shown or SENTENCE.search(text)) and not NOT_SHOWN.search(text) and text not in CLASSES:
            yield token.lineno, token.value


MODULES = sorted(path for path in SOURCE.rglob("*.js") if "vendor" not in path.parts)


def test_what_modules_of_pages_show_comes_from_the_catalogue():
    found = [(path.name, *one) for path in MODULES for one in unmarked(path.read_text())]
    assert found == []
    shown = 'a.textContent = "seed"; say(part, `car ${n} waits`); b = t("a car waits"); c.className = "seed"'
    assert [text for _, text in unmarked(shown)] == ['"seed"', "`car ${n} waits`"]

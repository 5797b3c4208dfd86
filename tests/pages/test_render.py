"""Pages from templates: text stays text, a file fetches nothing, a served page names addresses that hold the file."""

import hashlib
import json
import re
from importlib.resources import files
from pathlib import Path

import jinja2
import pytest
from babel.messages.extract import extract_from_file

import racecraft
from racecraft.pages.assets import PREFIX, find_served, imported
from racecraft.pages.every_part import every_part
from racecraft.pages.render import environment, module_texts, render, render_file, render_served, script_sum

SOURCE = Path(str(files("racecraft")))
FOR_FILES_ONLY = {"logs_explorer.html"}
SECTION = {"heading": "It's <here>", "body": ["<i>no</i>"]}


def test_what_is_given_stands_as_text():
    page = render("page.html", title="<script>alert(1)</script>", sections=[SECTION])
    assert "<script>alert" not in page
    assert "&lt;i&gt;no&lt;/i&gt;" in page


def test_data_for_a_module_cannot_end_its_element():
    chart = every_part()["charts"][0] | {"plot": {"name": "</script><script>alert(1)</script>", "gap": float("nan")}}
    page = render("every_part.html", **every_part() | {"charts": [chart]})
    assert "<script>alert" not in page
    inside = re.search(r'<script type="application/json">(.*?)</script>', page)[1]
    assert json.loads(inside) == {"name": "</script><script>alert(1)</script>", "gap": None}


def test_a_file_fetches_nothing():
    page = render_file("every_part.html", **every_part() | {"machine": ""})
    fetched = re.findall(r'(?:src|href)="([^"#]{2,60})|url\("?([^")]{2,60})', page)
    assert fetched
    assert {(first or second)[:5] for first, second in fetched} == {"data:"}
    assert PREFIX not in page


def test_a_served_page_names_files_by_their_sums():
    page = render("every_part.html", **every_part())
    names = re.findall(PREFIX + r"([\w.-]+)", page)
    assert len(names) >= 5
    for name in names:
        assert hashlib.sha256(find_served(name).data).hexdigest().startswith(name.split(".")[-2])


def test_the_only_inline_script_that_runs_is_the_import_map_with_its_sum():
    served = render_served("every_part.html", **every_part())
    inline = re.findall(r'<script type="importmap">(.*?)</script>', served.html)
    assert [script_sum(text) for text in inline] == list(served.script_sums)
    assert set(re.findall(r"<script type=\"(\w+/?\w*)", served.html)) == {"importmap", "module", "application/json"}
    assert " style=" not in served.html
    assert " on" + "click=" not in served.html


def test_a_template_of_another_package_is_found_by_its_name(tmp_path, monkeypatch):
    package = tmp_path / "stranger_pages"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "hello.html").write_text('{% extends "page.html" %}{% block lead %}hello {{ whom }}{% endblock %}')
    monkeypatch.syspath_prepend(str(tmp_path))
    assert "hello you" in render("stranger_pages/hello.html", title="", sections=[], whom="you")
    with pytest.raises(LookupError):
        render("stranger_pages/gone.html")


def test_colours_stand_in_the_tokens_alone():
    root = files("racecraft.pages")
    for folder in ("styles", "modules", "templates"):
        for path in (root / folder).iterdir():
            if path.name not in ("tokens.css", "icon.svg"):
                assert re.findall(r"#[0-9a-fA-F]{3,8}\b(?![-\w])", re.sub(r'href="#\w*"', "", path.read_text())) == []


def test_vendored_files_are_those_of_the_record():
    vendor = files("racecraft.pages") / "vendor"
    sums = json.loads((vendor / "sums.json").read_text())
    assert {name: hashlib.sha256((vendor / name).read_bytes()).hexdigest() for name in sums} == sums
    assert {path.name for path in vendor.iterdir()} - {"README.md", "sums.json"} == set(sums)


def test_no_template_styles_inline_which_served_pages_forbid():
    templates = [path for path in SOURCE.rglob("*.html") if path.name not in FOR_FILES_ONLY]
    assert len(templates) > 20
    assert [path.name for path in templates if "style=" in path.read_text(encoding="utf-8")] == []


def module_name(path):
    folders = path.relative_to(SOURCE.parent).parts[:-1]
    return f"{'.'.join(folders[:-1] if folders[-1] == 'modules' else folders)}/{path.name}"


MODULES = {module_name(path): path for path in sorted(SOURCE.rglob("*.js")) if "vendor" not in path.parts}


@pytest.mark.parametrize("name", MODULES)
def test_a_page_brings_the_texts_of_its_modules_in_the_readers_language(monkeypatch, name):
    """By twin: what the catalogue's extraction finds in a module and in what it imports is what the page brings."""
    monkeypatch.setattr("racecraft.pages.render.translate", str.swapcase)
    inside = {"parse_template_string": True}
    marked = {
        text
        for module in imported([name]) if module in MODULES
        for _, text, *_ in extract_from_file("javascript", MODULES[module], keywords={"t": None}, options=inside)
    }  # fmt: skip
    assert module_texts([name]) == {text: text.swapcase() for text in marked if text.swapcase() != text}


def test_every_template_can_be_read():
    """Those of pages that no test visits, too: a bracket too many is a page that answers 500."""
    templates = [path for path in Path(racecraft.__file__).parent.rglob("*.html") if "vendor" not in path.parts]
    assert len(templates) > 50
    for path in templates:
        try:
            environment(inline=False).parse(path.read_text(encoding="utf-8"))
        except jinja2.TemplateSyntaxError as error:
            pytest.fail(f"{path}:{error.lineno}: {error.message}")

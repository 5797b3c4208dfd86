"""What a stranger reads is held to the code: nothing missing, nothing stale, nothing that does not exist."""

import ast
import importlib.util
import inspect
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
FRONT = [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md")]
PAGES = [*FRONT, *sorted(DOCS.rglob("*.md"))]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INDENTED_COMMAND = re.compile(r"^    (racecraft .*)$", re.MULTILINE)
RACECRAFT_CODE = re.compile(r"`(racecraft [^`]+)`")

spec = importlib.util.spec_from_file_location("generate_docs", ROOT / "scripts" / "generate_docs.py")
generate_docs = importlib.util.module_from_spec(spec)
spec.loader.exec_module(generate_docs)


def place_of(path):
    return path.relative_to(ROOT).as_posix()


def commands():
    from racecraft.cli.app import app

    return dict(generate_docs.commands(app))


def options(function):
    """Return every spelling of every option of a command."""
    typed = [row[0] for row in generate_docs.options_of(function)]
    cells = [cell.replace(",", " ").replace("/", " ") for cell in typed if cell.startswith("-")]
    return {word for cell in cells for word in cell.split()} | {"--help"}


def lines_that_call_racecraft(text):
    """Yield each command line in blocks and in code spans, comments cut off."""
    for kind, body in FENCE.findall(text):
        if kind in ("", "text", "sh", "bash"):
            yield from (line.removeprefix("$ ").strip() for line in body.splitlines())
    yield from INDENTED_COMMAND.findall(FENCE.sub("", text))
    yield from RACECRAFT_CODE.findall(text)


def commands_on(path):
    """Yield the words of each racecraft command a page shows."""
    for line in lines_that_call_racecraft(path.read_text(encoding="utf-8")):
        if re.match(r"racecraft( [a-z-]|$)", line) and not line.startswith("racecraft: "):
            yield shlex.split(line, comments=True)


# --- complete ---------------------------------------------------------------------------------------------------------


def test_every_name_a_training_writes_into_its_metrics_has_a_row():
    from racecraft.training.callbacks import IterationReport
    from racecraft.training.run_writer import metrics_row

    losses = dict.fromkeys(ppo_figures(), 0.0)
    phases = dict.fromkeys(("collect", "learn", "judge", "keep_before"), 0.0)
    report = IterationReport(1, 1, 1.0, 1.0, 0, None, None, losses, None, False, phases)
    page = (DOCS / "reference/metrics.md").read_text(encoding="utf-8")
    assert [name for name in metrics_row(report) if f"| `{name}` |" not in page] == []


def ppo_figures():
    from racecraft.algorithms.ppo import FIGURES

    return FIGURES


def test_every_key_of_a_racers_files_is_spoken_of():
    from racecraft.worlds.deepracer.files.model_metadata import KEYS
    from racecraft.worlds.deepracer.training.presets import FROM_JSON

    page = (DOCS / "racing/your_folder.md").read_text(encoding="utf-8")
    keys = [*FROM_JSON, "term_cond_max_episodes", "term_cond_avg_score", "exploration_type", *KEYS]
    assert [key for key in keys if f"`{key}`" not in page] == []


def test_every_preset_and_every_stop_is_told():
    from racecraft.training.stopping import KINDS
    from racecraft.worlds.deepracer.training.presets import PRESETS

    presets = (DOCS / "racing/presets.md").read_text(encoding="utf-8")
    started = (DOCS / "racing/getting_started.md").read_text(encoding="utf-8")
    assert [name for name in PRESETS if f"| `{name}` |" not in presets] == []
    assert [kind for kind in KINDS if not re.search(rf"\| `{kind}(=[^`]*)?` \|", started)] == []


def test_everything_that_a_run_folder_holds_is_told():
    from racecraft.formats import run_folder
    from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder

    page = (DOCS / "racing/run_folder.md").read_text(encoding="utf-8")
    names = [value for name, value in vars(run_folder).items() if name.isupper() and isinstance(value, str)]
    names = [name for name in names if name != run_folder.FORMAT and not name.startswith("_")]
    strangers = AwsModelFolder(Path())
    places = [getattr(strangers, name) for name, kind in vars(AwsModelFolder).items() if isinstance(kind, property)]
    names += [place.as_posix() for place in places]
    names += [
        place.as_posix() for place in (strangers.evaluation_trace("STAMP"), strangers.evaluation_metrics("STAMP"))
    ]
    assert {"job.json", "metrics/TrainingMetrics.json"} <= set(names)
    assert [name for name in names if name not in page] == []


def test_every_package_has_a_line_in_the_architecture():
    import racecraft

    package = Path(inspect.getfile(racecraft)).parent
    packages = [f"{path.name}/" for path in package.iterdir() if (path / "__init__.py").is_file()]
    packages += [f"worlds/{path.name}/" for path in (package / "worlds").iterdir() if (path / "__init__.py").is_file()]
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    assert [name for name in packages if name != "worlds/" and f"| `{name}` |" not in page] == []


def test_every_file_that_the_architecture_names_is_there():
    import racecraft

    package = Path(inspect.getfile(racecraft)).parent
    rows = re.findall(
        r"^\| `([a-z/]+)` \| .* \| (.*) \|$", (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert len(rows) > 20
    for name, begin in rows:
        for file in re.findall(r"`([\w/]+\.py)`", begin):
            assert (package / name / file).is_file(), f"{name}{file}"


def test_generated_pages_are_current():
    stale = [place for place, text in generate_docs.pages().items() if (DOCS / place).read_text("utf-8") != text]
    assert stale == [], "`make docs` writes them anew"


# --- true -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", PAGES, ids=place_of)
def test_every_racecraft_command_on_a_page_exists_with_its_options(page):
    known = commands()
    for words in commands_on(page):
        name = next((name for name in sorted(known, key=len, reverse=True) if words_begin(words, name.split())), None)
        is_group = any(words_begin(other.split(), words) for other in known)
        if name is None and not is_group and words[1] not in ("--help", "--version", "COMMAND"):
            pytest.fail(f"{' '.join(words)}: no such command")
        ours = (
            words[: words.index("--env-args") + 1] if "--env-args" in words else words
        )  # what follows is the player's
        if words[1:3] == ["jobs", "run"] or words[1] == "tune":  # the same of a job's, and of a trial's
            begins = ("train", "gym", "snakes", "unity", "run", "serve")
            ours = words[: next((at for at, word in enumerate(words) if at > 2 and word in begins), None)]
        used = {word.partition("=")[0] for word in ours if re.match(r"--[a-z]", word)}
        legal = options(known[name]) if name else {"--help", "--version"}
        assert used <= legal, f"{' '.join(words)}: {used - legal}"


def words_begin(words, beginning):
    return words[: len(beginning)] == beginning


@pytest.mark.parametrize("page", FRONT, ids=place_of)
def test_every_make_word_on_a_page_exists(page):
    known = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    text = page.read_text(encoding="utf-8")
    used = set(re.findall(r"`make ([a-z]+)`", text)) | set(re.findall(r"^make ([a-z]+)", text, re.MULTILINE))
    assert used <= known


@pytest.mark.parametrize("page", PAGES, ids=place_of)
def test_internal_links_resolve(page):
    for target in LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
        if not re.match(r"[a-z]+:", target):
            assert (page.parent / target.partition("#")[0]).exists(), f"{place_of(page)}: {target}"


def python_blocks():
    for page in PAGES:
        for number, (kind, body) in enumerate(FENCE.findall(page.read_text(encoding="utf-8"))):
            if kind == "python":
                yield pytest.param(page, body, id=f"{place_of(page)}-{number}")


@pytest.mark.parametrize(("page", "body"), list(python_blocks()))
def test_python_on_a_page_compiles_and_its_names_can_be_imported(page, body):
    for node in ast.walk(ast.parse(body, filename=str(page))):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("racecraft"):
            module = importlib.import_module(node.module)
            names = [alias.name for alias in node.names if not hasattr(module, alias.name)]
            assert [name for name in names if importlib.util.find_spec(f"{node.module}.{name}") is None] == []


@pytest.mark.parametrize("name", ["python.md", "reward.md"])
def test_python_on_our_pages_runs(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    ran = 0
    for kind, body in FENCE.findall((DOCS / "racing" / name).read_text(encoding="utf-8")):
        if kind == "python":
            exec(compile(body, name, "exec"), {})
            ran += 1
    assert ran >= 2
    assert capsys.readouterr().out


def test_the_reader_of_episodes_in_the_run_folder_page_reads_what_we_write(tmp_path):
    import numpy as np

    from racecraft.formats.episodes import write_episodes

    (tmp_path / "episodes").mkdir()
    columns = {
        "episode": np.array([0, 0, 0, 1]),
        "world": np.array([0, 0, 1, 1]),
        "tick": np.array([241, 242, 230, 9]),
        "time_s": np.zeros(4),
        "status": np.array(["in_progress", "lap_complete", "lap_complete", "off_track"]),
        "done": np.array([False, True, True, True]),
    }
    write_episodes(tmp_path / "episodes" / "7.parquet", columns)
    names = {}
    (body,) = [
        body
        for kind, body in FENCE.findall((DOCS / "racing/run_folder.md").read_text("utf-8"))
        if kind == "python" and "laps_of" in body
    ]
    exec(compile(body, "run_folder.md", "exec"), names)
    assert names["laps_of"](str(tmp_path), 7)["tick"].to_list() == [230, 242]


@pytest.mark.parametrize("page", PAGES, ids=place_of)
def test_no_page_names_a_place_on_somebodys_machine(page):
    assert not re.search(r"(^|[\s`(])/(home|work|tmp|root|Users)/", page.read_text(encoding="utf-8"))


def test_the_documentation_builds_without_a_warning(tmp_path):
    pytest.importorskip("mkdocs", reason="mkdocs is a builder's tool")
    built = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", tmp_path],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    fetched = re.findall(r'(?:src|href)="https?://[^"]+\.(?:js|css)"', (tmp_path / "index.html").read_text("utf-8"))
    assert fetched == [], "a page must be readable without a network"


def test_every_page_is_in_the_menu():
    menu = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    pages = [page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")]
    assert [page for page in pages if f": {page}\n" not in menu] == []

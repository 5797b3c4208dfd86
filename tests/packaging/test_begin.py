"""The start by a double-click: what it does where a step fails, and at the second start. uv is a script here."""

import importlib.util
import json
import os
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

PACKAGING = Path(__file__).parents[2] / "packaging"
UV = """#!/bin/sh
echo "$@" >> "{calls}"
[ -f "{broken}" ] && [ "$1" = pip ] && {{ echo "error: no connection"; exit 2; }}
if [ "$1" = venv ]; then for last; do :; done; mkdir -p "$last/bin"; cp "{python}" "$last/bin/python"; fi
echo "Installed 3 packages"
"""
PYTHON = """#!/bin/sh
echo "python $@" >> "{calls}"
[ "$1" = -m ] && {{ echo '{{"address": "http://127.0.0.1:9/"}}'; sleep 0.3; }}
exit 0
"""


@pytest.fixture
def begin():
    spec = importlib.util.spec_from_file_location("begin", PACKAGING / "begin.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["begin"] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    yield module
    del sys.modules["begin"]


@pytest.fixture
def parts(tmp_path):
    """A download's `parts`, with programs that write down how they were called."""
    folder = tmp_path / "racecraft" / "parts"
    folder.mkdir(parents=True)
    (folder / "begin.html").write_text((PACKAGING / "begin.html").read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "racecraft-0.1.0-py3-none-any.whl").touch()
    names = {"calls": folder / "calls", "broken": folder / "broken", "python": folder / "fake"}
    for name, text in (("uv", UV), ("fake", PYTHON)):
        (folder / name).write_text(text.format(**names))
        (folder / name).chmod(0o755)
    return folder


pytestmark = pytest.mark.skipif(os.name == "nt", reason="the programs of these tests are shell scripts")


def test_the_first_start_makes_all_and_the_second_nothing(begin, parts):
    assert begin.main(["--no-open", "--no-retry"], parts) == 0
    calls = (parts / "calls").read_text().splitlines()
    assert [call.split()[0] for call in calls] == ["venv", "pip", "python", "python"]
    assert "racecraft-0.1.0-py3-none-any.whl" in calls[1]
    assert "--torch-backend" in calls[1]
    (parts / "calls").unlink()
    assert begin.main(["--no-open", "--no-retry"], parts) == 0
    assert [call.split()[:3] for call in (parts / "calls").read_text().splitlines()] == [["python", "-m", "racecraft"]]


def test_carried_packages_are_installed_without_a_network(begin, parts):
    (parts / "wheels").mkdir()
    begin.main(["--no-open", "--no-retry"], parts)
    assert "--no-index" in (parts / "calls").read_text().splitlines()[1]


def test_what_is_kept_stays_in_the_folder(begin, parts, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/elsewhere")
    variables = begin.Place(parts).variables()
    assert "PYTHONPATH" not in variables
    for name in ("UV_CACHE_DIR", "XDG_DATA_HOME", "XDG_CACHE_HOME", "MPLCONFIGDIR"):
        assert Path(variables[name]).is_relative_to(parts)


def test_a_step_that_fails_is_said_and_goes_on_when_asked(begin, parts, capsys):
    (parts / "broken").touch()
    done = []
    thread = threading.Thread(target=lambda: done.append(begin.main(["--no-open"], parts)), daemon=True)
    thread.start()
    page = ""
    for _ in range(1200):
        page = page or capsys.readouterr().out.partition("; ")[2].partition(" ")[0]
        if page and "no connection" in state(page)["message"]:
            break
        time.sleep(0.05)
    told = state(page)
    assert [step["state"] for step in told["steps"]] == ["done", "failed", "waits", "waits"]
    (parts / "broken").unlink()
    urllib.request.urlopen(urllib.request.Request(f"{page}again", b""))
    thread.join(60)
    assert done == [0]


def state(page):
    return json.loads(urllib.request.urlopen(f"{page}state").read())


def test_the_console_ends_with_the_window(parts):
    begin_py = parts / "begin.py"
    begin_py.write_text((PACKAGING / "begin.py").read_text(encoding="utf-8"), encoding="utf-8")
    fake = (parts / "fake").read_text().replace("sleep 0.3", f"trap 'touch {parts}/ended; exit' TERM; sleep 30 & wait")
    (parts / "fake").write_text(fake)
    with subprocess.Popen([sys.executable, begin_py, "--no-open"], stdout=subprocess.DEVNULL) as started:
        for _ in range(1200):
            if (parts / "running.json").exists():
                break
            time.sleep(0.05)
        started.terminate()
        started.wait(60)
    assert (parts / "ended").exists()
    assert not (parts / "running.json").exists()


def test_pages_of_other_sites_press_no_button(begin, parts):
    progress = begin.Progress([])
    server = begin.ThreadingHTTPServer(("127.0.0.1", 0), begin.handler(begin.Place(parts), progress))
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    address = f"http://127.0.0.1:{server.server_address[1]}/again"
    for headers in ({"Origin": "http://elsewhere.example"}, {"Host": "elsewhere.example:80"}):
        with pytest.raises(urllib.error.HTTPError, match="403") as refused:
            urllib.request.urlopen(urllib.request.Request(address, b"", headers))
        refused.value.close()
    assert not progress.retry.is_set()
    server.shutdown()
    server.server_close()


def test_the_folder_of_a_download_is_whole(tmp_path):
    (tmp_path / "python/bin").mkdir(parents=True)
    for name in ("python/bin/python3", "uv", "racecraft-0.1.0-py3-none-any.whl"):
        (tmp_path / name).write_text("x")
    words = ["--python", "python", "--uv", "uv", "--wheel", "racecraft-0.1.0-py3-none-any.whl"]
    subprocess.run(
        [sys.executable, PACKAGING / "make_download.py", "linux", "out", *words],
        cwd=tmp_path, check=True, capture_output=True,
    )  # fmt: skip
    folder = tmp_path / "out/racecraft"
    assert os.access(folder / "Start racecraft.sh", os.X_OK)
    inside = {path.name for path in (folder / "parts").iterdir()}
    assert inside >= {"begin.py", "begin.html", "uv", "python", "constraints.txt", "racecraft-0.1.0-py3-none-any.whl"}

"""A log that is dropped alone opens its laps; what is neither a model nor a log is refused and leaves nothing."""

import contextlib
import re
import tarfile
import urllib.error
import urllib.parse
import urllib.request

import pytest
from tests.reference import TRACES

from racecraft.console.application import make_console
from racecraft.console.pages import imports
from racecraft.jobs.job_paths import JobPaths
from racecraft.web.server import ServerThread

LOG = max((TRACES / "drfc-1-worker").rglob("*.csv"), key=lambda path: path.stat().st_size)


@pytest.fixture
def console(tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    home = JobPaths(tmp_path / "jobs", f"sqlite:///{tmp_path}/jobs.sqlite")
    server = ServerThread(make_console(tmp_path / "workspace", home), "console")
    yield f"http://127.0.0.1:{server.start('127.0.0.1', 0)}", tmp_path / "workspace"
    server.close()


def token_of(page):
    return re.search(r'name="form_token" value="([^"]*)"', page)[1]


def dropped(address, name, data):
    """Return the answer to a file dropped on a page: (address it led to, text)."""
    token = token_of(urllib.request.urlopen(f"{address}/import").read().decode())
    line = b"--seam\r\nContent-Disposition: form-data; name="
    body = line + b'"form_token"\r\n\r\n' + token.encode() + b"\r\n"
    body += line + f'"archive"; filename="{name}"\r\n\r\n'.encode() + data + b"\r\n--seam--\r\n"
    kind = {"Content-Type": "multipart/form-data; boundary=seam"}
    try:
        answer = urllib.request.urlopen(urllib.request.Request(f"{address}/import", body, kind))
    except urllib.error.HTTPError as error:
        answer = error
    with answer:
        return answer.geturl(), answer.read().decode()


def test_metrics_alone_open_what_they_tell(console):
    metrics = next((TRACES / "drfc-1-worker").rglob("EvaluationMetrics*.json"))
    led_to, page = dropped(console[0], metrics.name, metrics.read_bytes())
    assert f"racecraft logs {console[1]}" in page
    shown = urllib.request.urlopen(f"{led_to}/laps").read().decode()
    assert "Fastest laps" in shown
    assert "Path, speed, corners and actions are not in them" in shown


def test_files_without_weights_become_a_model_that_is_trained_as_they_stand(console, tmp_path, monkeypatch):
    begun = []
    monkeypatch.setattr(imports, "_logged", lambda console, place, file: "its-log")
    monkeypatch.setattr(imports, "begin_training", lambda home, model, words: begun.append((model.path, words)))
    with tarfile.open(tmp_path / "club.tar", "w") as archive:
        (tmp_path / "reward_function.py").write_text("def reward_function(params):\n    return 1.0\n")
        archive.add(tmp_path / "reward_function.py", "club/reward_function.py")
        archive.add(LOG, "club/training-simtrace/0-iteration.csv")
    led_to, page = dropped(console[0], "club.tar", (tmp_path / "club.tar").read_bytes())
    assert led_to == f"{console[0]}/import/club?log=its-log"
    assert "/logs/its-log" in page
    assert "Missing: weights, metadata, hyperparameters" in page
    assert "no hyperparameters.json: the preset&#39;s values" in page
    assert "/import/club" in urllib.request.urlopen(f"{console[0]}/models/club").read().decode(), "the way to train it"
    form = urllib.parse.urlencode({"form_token": token_of(page), "track": "Oval_track", "minutes": "2"}).encode()
    urllib.request.urlopen(f"{console[0]}/import/club/train", form)
    assert begun[0][0] == console[1] / "models/club"
    assert begun[0][1][:3] == ["train", ".", "--track=Oval_track"]


def test_a_trace_in_an_archive_opens_its_laps_and_says_why_it_is_no_model(console, tmp_path):
    """The console named its archives by model, kind and job: more letters than a model's name may have."""
    address, workspace = console
    name = f"my-model-{55 * 'x'}_logs.tar.gz"
    with tarfile.open(tmp_path / name, "w:gz") as archive:
        archive.add(LOG, "id/sim-trace/training/training-simtrace/0-iteration.csv")
    led_to, page = dropped(address, name, (tmp_path / name).read_bytes())
    assert led_to == f"{address}/logs/{name}"
    assert "A log without a model" in page
    assert f"{name}: it holds no file of a model" in page
    assert "racecraft telemetry" in page
    laps = urllib.request.urlopen(f"{led_to}/laps")
    assert "sandbox" in laps.headers["Content-Security-Policy"]
    assert "<title>" in laps.read().decode()
    assert {path.name for path in (workspace / "logs" / name).iterdir()} == {name, "laps.html", "page.json"}


def test_what_is_neither_leaves_nothing(console):
    address, workspace = console
    _, page = dropped(address, "model.tar.gz", b"nothing of the kind")
    assert "cannot be used" in page
    assert not list((workspace / "logs").glob("*"))
    assert not list((workspace / "models").glob("*"))

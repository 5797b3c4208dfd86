"""A log that is dropped alone opens its laps; what is neither a model nor a log is refused and leaves nothing."""

import contextlib
import re
import tarfile
import urllib.error
import urllib.request

import pytest
from tests.reference import TRACES

from racecraft.console.application import make_console
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


def dropped(address, name, data):
    """Return the answer to a file dropped on a page: (address it led to, text)."""
    page = urllib.request.urlopen(f"{address}/import").read().decode()
    token = re.search(r'name="form_token" value="([^"]*)"', page)[1]
    line = b"--seam\r\nContent-Disposition: form-data; name="
    body = line + b'"form_token"\r\n\r\n' + token.encode() + b"\r\n"
    body += line + f'"archive"; filename="{name}"\r\n\r\n'.encode() + data + b"\r\n--seam--\r\n"
    kind = {"Content-Type": "multipart/form-data; boundary=seam"}
    try:
        answer = urllib.request.urlopen(urllib.request.Request(f"{address}/import", body, kind))
    except urllib.error.HTTPError as error:
        answer = error
    return answer.geturl(), answer.read().decode()


def test_a_trace_alone_opens_its_laps(console):
    address, workspace = console
    led_to, page = dropped(address, "trace.csv", LOG.read_bytes())
    assert led_to == f"{address}/logs/trace.csv"
    assert "A log without a model" in page
    assert "racecraft telemetry" in page
    laps = urllib.request.urlopen(f"{led_to}/laps")
    assert "sandbox" in laps.headers["Content-Security-Policy"]
    assert "<title>" in laps.read().decode()
    assert {path.name for path in (workspace / "logs/trace.csv").iterdir()} == {"trace.csv", "laps.html"}


def test_logs_in_an_archive_of_a_long_name_say_why_they_are_no_model(console, tmp_path):
    """The console named its archives by model, kind and job: more letters than a model's name may have."""
    name = f"my-model-{55 * 'x'}_logs.tar.gz"
    with tarfile.open(tmp_path / name, "w:gz") as archive:
        archive.add(LOG, "id/sim-trace/training/training-simtrace/0-iteration.csv")
    led_to, page = dropped(console[0], name, (tmp_path / name).read_bytes())
    assert led_to == f"{console[0]}/logs/{name}"
    assert f"{name}: it holds no file of a model" in page


def test_what_is_neither_leaves_nothing(console):
    address, workspace = console
    for name in ("notes.txt", "model.tar.gz"):
        _, page = dropped(address, name, b"nothing of the kind")
        assert "cannot be used" in page
    assert not list((workspace / "logs").glob("*"))
    assert not list((workspace / "models").glob("*"))

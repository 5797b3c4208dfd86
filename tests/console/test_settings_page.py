"""The workspace as one file, through the page of the settings."""

import contextlib
import io
import re
import urllib.error
import urllib.parse
import urllib.request
import zipfile

import pytest
from tests.console.conftest import write_run

from racecraft.console.application import make_console
from racecraft.console.training import begin_training
from racecraft.console.workspace import Note
from racecraft.jobs.job_paths import JobPaths
from racecraft.web.server import ServerThread


def sent(address, token, data):
    """Return the page that answers the form with a file."""
    line = b"--seam\r\nContent-Disposition: form-data; name="
    body = line + b'"form_token"\r\n\r\n' + token.encode() + b"\r\n"
    body += line + b'"workspace"; filename="w.zip"\r\n\r\n' + data + b"\r\n--seam--\r\n"
    kind = {"Content-Type": "multipart/form-data; boundary=seam"}
    try:
        return urllib.request.urlopen(urllib.request.Request(f"{address}/settings/restore", body, kind)).geturl()
    except urllib.error.HTTPError as error:
        error.close()
        return "refused"


def test_a_workspace_is_saved_and_brought_back_through_the_page(tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    home = JobPaths(tmp_path / "jobs", f"sqlite:///{tmp_path}/jobs.sqlite")
    server = ServerThread(make_console(tmp_path / "workspace", home), "console")
    address = f"http://127.0.0.1:{server.start('127.0.0.1', 0)}"
    try:
        write_run(tmp_path / "workspace/runs/oval-1")
        saved = urllib.request.urlopen(f"{address}/settings/workspace.zip").read()
        assert "runs/oval-1/job.json" in zipfile.ZipFile(io.BytesIO(saved)).namelist()
        page = urllib.request.urlopen(f"{address}/settings").read().decode()
        token = re.search(r'name="form_token" value="([^"]*)"', page)[1]
        assert sent(address, token, saved) == f"{address}/models"
        assert (tmp_path / "workspace/runs/oval-2/job.json").is_file()
        assert sent(address, token, b"no zip") == "refused"
        assert sent(address, "forged", saved) == "refused"
        assert {path.name for path in (tmp_path / "workspace/runs").iterdir()} == {"oval-1", "oval-2"}
    finally:
        server.close()


def test_where_messages_go_is_kept_and_given_to_each_training(tmp_path, monkeypatch):
    begun = []
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    monkeypatch.setattr(
        "racecraft.console.training.submit_numbered", lambda home, base, spec: begun.append(spec("one"))
    )
    home = JobPaths(tmp_path / "jobs", f"sqlite:///{tmp_path}/jobs.sqlite")
    application = make_console(tmp_path / "workspace", home)
    server = ServerThread(application, "console")
    address = f"http://127.0.0.1:{server.start('127.0.0.1', 0)}"
    try:
        page = urllib.request.urlopen(f"{address}/settings").read().decode()
        token = re.search(r'name="form_token" value="([^"]*)"', page)[1]

        def send(notify):
            body = urllib.parse.urlencode({"form_token": token, "notify": notify}).encode()
            return urllib.request.urlopen(f"{address}/settings/notify", body).read().decode()

        assert "https://chat.example.org/hook" in send("https://chat.example.org/hook\nmailto:me@example.org")
        with pytest.raises(urllib.error.HTTPError) as refused:
            send("pigeon")
        refused.value.close()
        model = application.state.console.workspace.create("mint", {}, Note())
        begin_training(home, model, ["train", ".", "--stop=minutes=1"])
    finally:
        server.close()
    told = ("--notify=https://chat.example.org/hook", "--notify=mailto:me@example.org")
    assert [word for word in begun[0].command if word.startswith("--notify")] == list(told)
    assert set(told) <= set(begun[0].resume)

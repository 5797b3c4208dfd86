"""Requests mutated from valid ones: each is answered or refused, and the workspace stays one that can be listed."""

import contextlib
import random
import re
import urllib.error
import urllib.parse
import urllib.request
from types import SimpleNamespace

import pytest
from tests.console.conftest import write_run

from racecraft.console.application import make_console
from racecraft.console.pages import create, garage, imports, races
from racecraft.jobs.job_paths import JobPaths
from racecraft.league.race import Drive, Entry, Outcome, Race, Result
from racecraft.league.store import League
from racecraft.web.server import ServerThread

JUNK = (
    "", "..", chr(0), "<script>alert(1)</script>", "a" * 5000, "-1", "1e309", "nan",
    "\u0661", "\u202e", "../../etc/passwd",
    "' or 1=1 --", "%", "#t", "m0", "r1", "{}", "true", "0x10", "9" * 40, "\u00e9", "best",
)  # fmt: skip
GETS = (
    "/models?q={}", "/models?sort={}", "/models?after={}&sort=best", "/models?before={}",
    "/models?status={}&tag={}", "/models/{}", "/models/m0/{}",
    "/models/m0/laps?lap={}&actions={}", "/compare?m={}&m={}", "/models/m0/files/{}", "/models/m0/checkpoints?by={}",
    "/models/m0/evaluations", "/models/{}/logs.zip", "/drafts/{}/track", "/drafts/new?kind={}", "/drafts/new?from={}",
    "/pictures/deepracer/{}.svg", "/pictures/{}/x.svg", "/models/m0/view/{}",
    "/models/m0/reward/look?speed={}&term={}", "/drafts/{}/reward/look?heading={}",
    "/import/{}", "/models/{}/watch/api/run", "/models/m0/watch/{}",
    "/races/new?kind={}", "/races/{}", "/races/cup/drives/{}", "/races/cup/drives/00001?track={}&lap={}&against={}",
    "/races/cup/drives/{}/files.zip?track={}", "/races/cup/drives/00001/film.mp4?track={}",
    "/races/cup/drives/00001/film.jpg?track={}", "/races/cup/enter?model={}",
    "/races/{}/edit", "/races/{}/copy", "/races/cup/drives/00001/{}", "/racers/{}", "/seasons/{}", "/races/{}/show",
)  # fmt: skip
POSTS = {
    "/models/act": ("act", "m", "place", "tag"), "/models/first": ("kind",), "/models/m0/note": ("tags", "text"),
    "/models/m1/rename": ("name",), "/models/m0/resume": ("minutes",), "/models/m0/stop": ("x",),
    "/jobs/{}/stop": ("x",), "/models/{}/note": ("text",), "/import": ("archive",),
    "/import/{}/train": ("track", "minutes"), "/models/m0/export": ("to",),
    "/models/m0/why": ("x",), "/models/m0/checkpoints": ("kept", "confirm"),
    "/races/new": ("kind", "title", "track", "laps", "closes", "season", "go"),
    "/seasons/new": ("title", "points", "go"),
    "/races/cup/edit": ("title", "opens", "closes", "submissions", "season"), "/races/cup/copy": ("title", "closes"),
    "/races/cup/enter": ("model", "which", "racer"), "/races/cup/act": ("act",), "/races/cup/withdraw": ("entry",),
    "/races/cup/drives/{}/film": ("track",),
    "/drafts/ID/track": ("edits", "writer", "name", "go", "track"), "/drafts/ID/algorithm": ("go", "lr", "num_epochs"),
    "/drafts/ID/car": ("actions", "camera", "go"), "/drafts/ID/reward": ("reward", "go", "minutes"),
}  # fmt: skip
REFUSED = {400, 403, 404, 409, 422}
ANSWERED = {200, 303, 307}


class Stay(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *told):
        return None


def ask(address, data=None):
    """Return status, headers and text; redirects are not followed."""
    request = urllib.request.Request(address, data, {"Accept": "text/html"})
    try:
        answer = urllib.request.build_opener(Stay).open(request, timeout=60)
    except urllib.error.HTTPError as error:
        answer = error
    with answer:
        return answer.getcode(), answer.headers, answer.read().decode("utf-8", "replace")


@pytest.mark.parametrize("count", [120, pytest.param(1000, marks=pytest.mark.long)])
def test_no_mutated_request_breaks_the_console(tmp_path, monkeypatch, count):
    for page in (create, garage, imports):
        monkeypatch.setattr(page, "begin_training", lambda home, model, words: None)
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    application = make_console(tmp_path / "workspace", JobPaths(tmp_path / "jobs", f"sqlite:///{tmp_path}/jobs.sqlite"))
    workspace = application.state.console.workspace
    for number in range(2):
        write_run(workspace.path / f"runs/r{number}")
        model = workspace.create(f"m{number}", {"reward_function.py": "x = 1"})
        write_run(model.path / "runs/1")
    league = League.open_or_create(workspace.path / "league")
    league.add_race(Race(id="", title="Cup", kind="deepracer", tracks=("Oval_track",), rules={}))
    league.add_entry("cup", lambda folder: Entry(number=0, racer="Bob", model="m", entered=1.0))
    drive = Drive(track="Oval_track", seed=1, outcomes=(Outcome(laps=(9.0,)),), folder="drives/00001-0")
    league.save_result("cup", Result(heat="00001", entries=(1,), drives=(drive,), judged=1.0), {0: {"x": b""}})
    monkeypatch.setattr(races, "judge_of", lambda path: SimpleNamespace(judge=print, expect=print, faults={}))
    server, chance = ServerThread(application, "console"), random.Random(1)
    address = f"http://127.0.0.1:{server.start('127.0.0.1', 0)}"
    _, headers, _ = ask(f"{address}/drafts/new")
    draft = headers["location"].rsplit("/", 1)[0]
    token = re.search(r'name="form_token" value="([^"]+)"', ask(f"{address}/models")[2])[1]
    broken = []
    for _ in range(count):
        data = None
        if chance.random() < 0.6:
            path = chance.choice(GETS)
        else:
            path = chance.choice(list(POSTS))
            fields = {name: chance.choice(JUNK) for name in POSTS[path] if chance.random() < 0.8}
            fields |= {"form_token": token} if chance.random() < 0.9 else {}
            fields |= {"act": chance.choice(("delete", "archive", "tag", "restore"))} if "act" in fields else {}
            fields |= {"go": "create"} if "go" in fields and chance.random() < 0.4 else {}
            data = urllib.parse.urlencode(fields).encode()
        while "{}" in path:
            path = path.replace("{}", urllib.parse.quote(chance.choice(JUNK), safe=""), 1)
        status, headers, text = ask(address + path.replace("/drafts/ID", draft), data)
        is_script = "html" in (headers["content-type"] or "") and "<script>alert" in text
        if status not in REFUSED | ANSWERED or is_script:
            broken.append((status, path, data))
    status, _, _ = ask(f"{address}/models")
    server.close()
    assert broken == []
    assert status == 200
    assert sorted(path.name for path in workspace.path.iterdir() if path.is_dir()) == [
        "bin", "drafts", "league", "models", "runs", *(["uploads"] if (workspace.path / "uploads").exists() else [])
    ]  # fmt: skip

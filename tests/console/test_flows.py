"""A browser walks the console: each flow with its clicks counted, each page looked at by axe."""

import contextlib
import io
import json
import re
import shutil
import tarfile
import threading
import zipfile
from pathlib import Path

import numpy as np
import pytest
from tests.browser import Browser, needs_chromium
from tests.console.conftest import write_run
from tests.reference import TRACES

from racecraft.console import tasks
from racecraft.console.application import make_console
from racecraft.console.helper import Helper
from racecraft.console.helper import _call as helper_call
from racecraft.console.pages import create, garage
from racecraft.console.workspace import Note
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_lock import RunLock
from racecraft.jobs.job_paths import JobPaths
from racecraft.web.server import ServerThread

pytestmark = needs_chromium


@pytest.fixture
def console(tmp_path, monkeypatch):
    """A console over a workspace, its trainings written down instead of begun: (address, workspace, begun)."""
    begun = []

    def begin(home, model, words):
        begun.append((model.name, words))

    for page in (create, garage):
        monkeypatch.setattr(page, "begin_training", begin)
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    application = make_console(tmp_path / "workspace", JobPaths(tmp_path / "jobs", f"sqlite:///{tmp_path}/jobs.sqlite"))
    server = ServerThread(application, "console")
    port = server.start("127.0.0.1", 0)
    yield f"http://127.0.0.1:{port}", application.state.console.workspace, begun
    server.close()


@pytest.fixture
def browser():
    made = Browser(1440, 900)
    yield made
    made.close()


@pytest.fixture
def other_browser():
    made = Browser(1440, 900)
    yield made
    made.close()


class Clicks:
    """Clicks, counted."""

    def __init__(self, page):
        self.page, self.count = page, 0

    def __call__(self, what):
        self.count += 1
        self.page.click(what)


def test_one_click_makes_a_model_and_begins_its_training(console, browser):
    address, workspace, begun = console
    browser.open(address)
    click = Clicks(browser.page)
    click("#train-first")
    browser.page.wait_for_url("**/models/first-car")
    assert click.count == 1
    assert [name for name, _ in begun] == ["first-car"]
    assert begun[0][1] == ["train", ".", "--track=reinvent_base", "--stop=minutes=1", "--no-pictures"]
    files = {path.name for path in (workspace.path / "models/first-car").iterdir()}
    assert files >= {"reward_function.py", "model_metadata.json", "model.json"}
    browser.page.click("text=Show as command")
    with browser.page.expect_download() as download:
        browser.page.click("text=As notebook")
    notebook = json.loads(Path(download.value.path()).read_text())
    assert notebook["cells"][0]["source"] == f"%%bash\ncd {workspace.path}/models/first-car"
    assert browser.complaints == []


def test_six_clicks_lead_through_all_steps_and_three_to_another_track(console, browser, monkeypatch):
    address, workspace, begun = console
    write_run(workspace.path / "runs/old")
    browser.open(f"{address}/models")
    click = Clicks(browser.page)
    click("text=Create model")
    for step in ("race", "algorithm", "car", "reward"):
        click("aside button:has-text('Next')")
        browser.page.wait_for_url(f"**/{step}")
    click("#create")
    browser.page.wait_for_url("**/models/my-car")
    assert click.count == 6
    browser.open(f"{address}/models")
    click = Clicks(browser.page)
    click("text=Create model")
    click("label:has(input[value=Oval_track])")
    click("#create")
    browser.page.wait_for_url("**/models/my-car-2")
    assert click.count == 3
    assert [name for name, _ in begun] == ["my-car", "my-car-2"]
    assert "--track=Oval_track" in begun[1][1]
    run = write_run(workspace.path / "models/my-car/runs/1")
    with RunLock(run):
        browser.page.goto(f"{address}/models/my-car")
        browser.page.click("text=Change and go on")
    browser.page.click("#create")
    browser.page.wait_for_url("**/models/my-car")
    assert begun[2][0] == "my-car"
    assert f"--from={run}:last" in begun[2][1]
    metadata = workspace.path / "models/my-car/model_metadata.json"
    assert json.loads(metadata.read_text())["version"] == "4", "the car stays what it was"
    browser.page.goto(f"{address}/drafts/new?from=my-car")
    browser.page.fill("[name=name]", "my-car")
    browser.page.click("#create")
    assert "my-car" in browser.page.inner_text(".notice.bad")
    assert len(begun) == 3, "a clone by its model's name takes the place of nothing"
    shutil.copytree(TRACES / "drfc-1-worker/evaluation-20220709200242", run / "evaluation-20220709200242")
    monkeypatch.setattr(Helper, "ask", lambda helper, function, *arguments: "-20, 1\n20, 3")
    browser.page.goto(f"{address}/models/my-car/laps")
    click = Clicks(browser.page)
    click("#design")
    browser.page.wait_for_url("**/car")
    click("#create")
    browser.page.wait_for_url("**/models/my-car-3")
    assert click.count == 2
    assert (begun[3][0], any(word.startswith("--from") for word in begun[3][1])) == ("my-car-3", False)
    actions = json.loads((workspace.path / "models/my-car-3/model_metadata.json").read_text())["action_space"]
    assert [(one["steering_angle"], one["speed"]) for one in actions] == [(-20.0, 1.0), (20.0, 3.0)]


def test_a_fault_is_shown_where_it_is_and_nothing_is_made(console, browser):
    address, workspace, begun = console
    browser.open(f"{address}/drafts/new")
    page = browser.page
    page.click("button:has-text('Algorithm')")
    page.fill("#lr", "much")
    page.click("button:has-text('Car')")
    page.wait_for_url("**/car")
    move_actions(page)
    page.click("#create")
    page.wait_for_selector("#lr[aria-invalid]")
    assert "expected a number from" in page.inner_text("#lr-wrong")
    assert page.input_value("#lr") == "much"
    page.fill("#lr", "0,002")
    page.click("button:has-text('Reward')")
    page.click("rc-editor .editor")
    page.keyboard.press("Control+a")
    page.keyboard.type("def reward_function(params:\n")
    page.click("#create")
    page.wait_for_selector(".notice.bad")
    assert "reward_function.py:1" in page.inner_text(".notice.bad")
    assert begun == []
    assert list(workspace.models()) == []


def move_actions(page):
    """Move the points of the default table by mouse and keys; the lines of the form stay in step."""
    before = page.input_value("#actions").splitlines()
    plot, point = page.locator("#polar").bounding_box(), page.locator("#polar .dot").nth(7).bounding_box()
    mps = plot["height"] / 225 * 50
    page.mouse.move(point["x"] + point["width"] / 2, point["y"] + point["height"] / 2)
    page.mouse.down()
    page.mouse.move(plot["x"] + plot["width"] / 2, plot["y"] + plot["height"] * 215 / 225 - 3.4 * mps)
    page.mouse.up()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowDown")
    assert before[7] == "0, 2.5"
    assert page.input_value("#actions").splitlines() == [*before[:7], "1, 2.9", *before[8:]]
    assert page.get_attribute("#polar .dot:focus", "aria-valuetext") == "1° at 2.9 m/s"
    page.keyboard.press("+")
    assert page.input_value("#actions").splitlines()[-1] == "1, 2.9"
    page.keyboard.press("Delete")
    assert page.locator("#polar .dot").count() == len(before)


def test_a_fault_of_the_reward_is_marked_in_its_line_while_one_types(console, browser):
    address, _, _ = console
    browser.open(f"{address}/drafts/new")
    page = browser.page
    page.click("button:has-text('Reward')")
    page.wait_for_url("**/reward")
    page.wait_for_selector("[data-remarks] .strip", timeout=30_000)
    page.click("rc-editor .editor")
    page.keyboard.press("Control+End")
    page.keyboard.type("\n\n\ndef never():\nx = 1\n")
    page.wait_for_selector("rc-editor .cm-lint-marker", timeout=30_000)
    assert "never run" in page.inner_text("[data-remarks]")
    assert page.input_value("#reward").endswith("def never():\n    x = 1\n    ")
    page.select_option("[data-look] select[name=term]", "metres")
    page.wait_for_selector("text=What it pays: metres", timeout=30_000)
    assert browser.complaints == []


def test_the_logs_of_a_training_are_one_file_and_its_report_a_page(console, browser, monkeypatch):
    address, workspace, _ = console
    run = write_run(workspace.path / "runs/a-1")
    (run / "training-simtrace").mkdir()
    (run / "training-simtrace/0-iteration.csv").write_text("episode,steps\n")
    (run / "policy.safetensors").write_bytes(b"0")

    def command(words, folder):
        assert words == ["report", str(run)]
        (run / "report.html").write_text("<h1>How a-1 went</h1>")
        return {}

    monkeypatch.setattr(tasks, "run_command", command)
    page = browser.page
    browser.open(f"{address}/models/a-1/files")
    assert page.locator("button[name=to]:disabled").count() == 6
    assert "there is no checkpoint" in page.inner_text(".card .notice"), "and why"
    with page.expect_download() as download:
        page.click("text=Logs as one file")
    names = zipfile.ZipFile(download.value.path()).namelist()
    assert names == ["metrics.jsonl", "training-simtrace/0-iteration.csv"]
    page.click("text=Write a report")
    page.click("text=The report, as one page")
    assert page.inner_text("h1") == "How a-1 went"
    browser.open(f"{address}/import/a-1")
    assert "Missing: weights, reward function, metadata, hyperparameters" in page.inner_text("main")


SEEDS = [{"run": "a-1", "score": 6.6, "values": [6.5, None, 6.7]}]
JUDGED = {
    "best_lap_seconds": 6.533333, "verdict": ["a-1 is faster."], "measure": "lap",
    "groups": [{"name": "a-1", "seeds": SEEDS}],
}  # fmt: skip


@pytest.mark.parametrize(
    ("path", "button", "told", "dots"),
    [("/models/a-1/evaluations", "Evaluate", '"6.533"', 0), ("/compare?m=a-1&m=b-1", "Judge on", "a-1 is faster.", 2)],
)
def test_a_page_goes_on_while_models_are_judged_and_shows_what_it_came_to(
    console, browser, monkeypatch, path, button, told, dots
):
    address, workspace, _ = console
    judged = threading.Event()
    monkeypatch.setattr(tasks, "run_command", lambda words, folder: judged.wait(60) and JUDGED)
    write_run(workspace.path / "runs/a-1")
    write_run(workspace.path / "runs/b-1", lap=8.0)
    page = browser.page
    page.goto(f"{address}/models")
    page.wait_for_selector("tr[data-row='b-1']")
    page.goto(address + path)
    page.click(f"button:has-text('{button}')")
    page.wait_for_selector("text=Judging on fresh starts …")
    judged.set()
    page.wait_for_selector(f"text={told}")
    assert page.locator(".notice:visible").count() == 0
    assert page.locator("svg.dots circle").count() == dots, "each start that finished"


def test_models_that_are_chosen_are_compared_by_their_curves_and_their_laps(console, browser, monkeypatch):
    address, workspace, _ = console
    monkeypatch.setattr(Helper, "ask", lambda helper, function, *arguments: helper_call(function, *arguments))
    for name in ("a-1", "b-1", "c-1"):
        run = write_run(workspace.path / f"runs/{name}")
        metrics = run / "metrics.jsonl"
        metrics.write_text(metrics.read_text().replace('"evaluation_score": null', '"evaluation_score": 50.0'))
        trace = "evaluation-20220709200242/evaluation-simtrace/0" if name != "c-1" else "training-simtrace/19"
        (run / trace).parent.mkdir(parents=True)
        shutil.copy(TRACES / f"drfc-1-worker/{trace}-iteration.csv", (run / trace).parent)
    page = browser.page
    page.goto(f"{address}/models")
    page.wait_for_selector("tr[data-row='c-1']")
    for name in ("a-1", "b-1"):
        page.check(f"input[name=m][value='{name}']")
    page.click("button:has-text('Compare')")
    page.wait_for_url(re.compile(r"/compare\?m=\w-1&m=\w-1$"))
    page.click("#choose summary")
    page.uncheck("#choose input[value='a-1']")
    page.check("#choose input[value='c-1']")
    page.click("#choose button")
    page.wait_for_url("**/compare?m=*")
    shown = page.locator("rc-chart").nth(1).locator(".key button span").all_inner_texts()
    assert {"b-1", "c-1"} < set(shown), "and their median"
    page.emulate_media(reduced_motion="reduce")
    page.wait_for_selector("rc-ghosts .player")
    assert page.locator("rc-ghosts g.car:visible").count() == 2
    assert page.locator("[data-look] tbody tr").count() == 2
    page.focus("rc-ghosts .play")
    page.keyboard.press("Enter")
    browser.until("document.querySelector('rc-ghosts input').value > 0")
    page.keyboard.press("Enter")
    assert int(page.input_value("rc-ghosts input")) >= 7, "half a second at once where little motion is wanted"
    page.focus("rc-ghosts input")
    page.keyboard.press("End")
    assert page.get_attribute("rc-ghosts input", "aria-valuetext") == page.inner_text("rc-ghosts output")
    page.keyboard.press("Home")
    page.keyboard.press("PageUp")
    places = "[...document.querySelectorAll('rc-ghosts g.car')].map(car => car.getAttribute('transform'))"
    together = browser.value(places)
    page.select_option("rc-ghosts .order", "end")
    assert page.locator("[data-look][aria-busy]").count() == 0, "no choice in the player brings the map anew"
    moved = [one != other for one, other in zip(together, browser.value(places), strict=True)]
    assert sorted(moved) == [False, True], "the faster car waits"
    assert browser.shut_out() == []


DROP_A_FOLDER = """names => {
  const leaf = name => ({ name, isFile: true, file: done => done(new File([`in ${name}`], name)) });
  const reader = inside => ({ readEntries: done => done(inside.splice(0, 1)) });
  const folder = (name, inside) => ({ name, isDirectory: true, createReader: () => reader(inside) });
  const tree = names => folder(names[0], names.length > 2 ? [tree(names.slice(1))] : [leaf(names[1]), leaf("b.csv")]);
  DataTransferItem.prototype.webkitGetAsEntry = () => tree(names);
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([], names[0]));
  document.body.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
}"""


def test_a_dropped_folder_comes_as_one_archive(console, browser):
    page, names = browser.page, ["my-car", "x" * 90, "y" * 60, "reward_function.py"]
    browser.open(f"{console[0]}/import")
    page.route("**/import", lambda route: route.fulfill(body="<main>taken</main>", content_type="text/html"))
    with page.expect_request("**/import") as sent:
        page.evaluate(DROP_A_FOLDER, names)
    page.wait_for_selector("text=taken")
    body = sent.value.post_data_buffer
    assert b'filename="my-car.tar"' in body
    start = body.index(b"\r\n\r\n", body.index(b'filename="')) + 4
    with tarfile.open(fileobj=io.BytesIO(body[start:])) as archive:
        held = {one.name: archive.extractfile(one).read() for one in archive}
    above = "/".join(names[:-1])
    assert held == {f"{above}/{name}": b"in " + name.encode() for name in ("reward_function.py", "b.csv")}


def test_a_draft_is_kept_while_one_types(console, browser):
    address, _, _ = console
    browser.open(f"{address}/drafts/new")
    page = browser.page
    page.fill("#name", "kept")
    page.wait_for_selector("text=Draft kept.")
    page.reload()
    assert page.input_value("#name") == "kept"
    page.select_option("#by-length", "middle")
    page.select_option("#by-directions", "cw")
    page.fill("#find-cards", "speedway")
    assert page.inner_text("#cards-left") == "3 circuits"
    assert page.locator(".circuit:visible b").all_inner_texts() == ["Smile Speedway", "RL Speedway", "Hot Rod Speedway"]
    page.reload()
    assert page.inner_text("#cards-left") == "3 circuits"


def test_who_comes_second_is_shown_both_versions_and_keeps_one_or_both(console, browser, other_browser):
    address, workspace, _ = console
    model = workspace.create("shared", {}, Note(text="one\ntwo"))
    first, second = browser.page, other_browser.page
    for page in (first, second):
        page.goto(f"{address}/models/shared")
    first.fill("#text", "one\nfast in turn 1")
    first.fill("#tags", "race")
    first.click("text=Keep")
    first.wait_for_selector("#tags[value='race']")
    second.fill("#text", "one\nslow in turn 1")
    second.click("text=Keep")
    second.wait_for_selector("text=changed elsewhere")
    assert model.note().text == "one\nfast in turn 1"
    assert second.locator(".versions tr.fresh").count() == 2
    second.click("text=Keep both")
    second.wait_for_url("**/models/shared")
    assert (model.note().text, model.note().tags) == ("one\nslow in turn 1\nfast in turn 1", ("race",))


def test_a_draft_that_changed_elsewhere_shows_both_and_keeps_what_was_typed(console, browser, other_browser):
    address, workspace, begun = console
    browser.open(f"{address}/drafts/new")
    first, second = browser.page, other_browser.page
    first.click("button:has-text('Algorithm')")
    first.wait_for_url("**/algorithm")
    second.goto(first.url)
    first.fill("#lr", "0.002")
    first.wait_for_selector("text=Draft kept.")
    second.fill("#lr", "0.005")
    second.wait_for_selector("text=changed elsewhere")
    second.click("#create")
    second.wait_for_selector(".versions")
    assert second.inner_text(".versions tr.fresh") == "0.005\t0.002"
    assert second.input_value("#lr") == "0.005"
    assert begun == []
    second.click("#create")
    second.wait_for_url("**/models/my-car")
    made = json.loads((workspace.path / "models/my-car/hyperparameters.json").read_text())
    assert made["lr"] == 0.005


def test_deleted_models_come_back_by_undo_and_a_run_of_the_command_line_appears(console, browser):
    address, workspace, _ = console
    write_run(workspace.path / "runs/a-1")
    browser.open(f"{address}/models")
    page = browser.page
    page.wait_for_selector("tr[data-row='a-1']")
    page.evaluate("""() => {
        const close = EventSource.prototype.close, later = setTimeout;
        EventSource.prototype.close = function () { document.body.dataset.closed = ""; close.call(this); };
        window.setTimeout = (act, milliseconds) => later(act, milliseconds / 100);
        Object.defineProperty(document, "hidden", { value: true, configurable: true });
        document.dispatchEvent(new Event("visibilitychange")); }""")
    page.wait_for_selector("body[data-closed]")  # a hidden page lets go of its stream, and goes on when it is shown
    page.evaluate("delete document.hidden, document.dispatchEvent(new Event('visibilitychange'))")
    write_run(workspace.path / "runs/b-1")
    page.wait_for_selector("tr[data-row='b-1']", timeout=20_000)  # 5 s where nothing else runs
    page.check("input[value='a-1']")
    page.click("button:has-text('Delete')")
    page.wait_for_selector("#undo")
    assert not (workspace.path / "runs/a-1").exists()
    page.keyboard.press("z")
    page.wait_for_selector("tr[data-row='a-1']")
    assert (workspace.path / "runs/a-1/job.json").is_file()
    beside = page.context.new_page()
    beside.goto(f"{address}/models/b-1")
    (workspace.path / "runs/b-1").rename(workspace.path / "elsewhere")
    beside.wait_for_selector("text=runs/b-1: this folder is gone", timeout=20_000)
    assert beside.locator("rc-cars").count() == 0, "nothing asks for pictures any more"
    page.wait_for_selector("tr[data-row='b-1']:has-text('this folder is gone')", timeout=20_000)
    assert "runs/b-1: this folder is gone" in page.request.get(f"{address}/models/b-1").text()
    page.check("input[value='b-1']")
    page.click("button:has-text('Delete')")
    page.wait_for_selector("tr[data-row='b-1']", state="detached")


def test_settings_tell_the_keys_switch_them_off_and_tell_what_takes_the_disk(console, browser):
    address, workspace, _ = console
    write_run(workspace.path / "runs/a-1")
    (workspace.path / "runs/a-1/policy.safetensors").write_bytes(bytes(3_000_000))
    page = browser.page
    browser.open(f"{address}/models")
    page.keyboard.press("?")
    page.wait_for_url("**/settings#keys")
    page.wait_for_selector("[data-look] li:has-text('3.0 MB')", timeout=60_000)
    page.uncheck("#use-keys")
    page.keyboard.press("g")
    page.keyboard.press("n")
    page.reload()
    assert not page.is_checked("#use-keys")
    page.check("#use-keys")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("g")
    page.wait_for_url(f"{address}/")
    (workspace.path / "runs/a-1/checkpoints").mkdir()
    shelf = Checkpoints(workspace.path / "runs/a-1/checkpoints")
    for iteration in range(8):
        shelf.save(iteration, iteration, {"w": np.ones(3)}, {}, score=1.0, best=iteration == 3)
    for name, then in (("a-2", "expected 'a-1'"), ("a-1", "5 checkpoints take")):
        page.goto(f"{address}/models/a-1/checkpoints")
        page.fill("#kept", "1")
        page.fill("#confirm", name)
        page.click("text=Delete the rest")
        page.wait_for_selector(f"text={then}")
    assert {0, 3, 6, 7} < {entry.iteration for entry in shelf.entries()}


def test_no_page_shuts_anybody_out_by_day_or_by_night(console, browser):
    address, workspace, _ = console
    write_run(workspace.path / "runs/a-1")
    write_run(workspace.path / "runs/b-1", lap=8.0)
    browser.bypass_policy()
    browser.open(f"{address}/drafts/new")
    draft = browser.page.url.rsplit("/", 1)[0]
    steps = [f"{draft}/{step}" for step in ("track", "race", "algorithm", "car", "reward")]
    pages = [
        "/models", "/models/a-1", "/models/a-1/checkpoints", "/models/a-1/evaluations", "/models/a-1/files",
        "/models/a-1/reward", "/models/a-1/why",
        "/compare?m=a-1&m=b-1", "/import", "/jobs", "/settings",
    ]  # fmt: skip
    found = {}
    for page in [*steps, *(address + path for path in pages)]:
        browser.open(page)
        for dark in (False, True):
            browser.show(1440, dark=dark)
            if faults := browser.shut_out():
                found[page, dark] = faults
    assert found == {}


def test_a_phone_scrolls_down_only(console):
    address, workspace, _ = console
    write_run(workspace.path / "runs/a-1")
    job = write_run(workspace.path / "runs/b-with-a-longer-name-1") / "job.json"
    job.write_text(
        job.read_text().replace('"settings": {', '"settings": {"a_group": {"with_a_setting_of_a_long_name": 1}, ')
    )
    browser = Browser(390, 844, touch=True)
    wide = {}
    paths = ("/models", "/models/a-1", "/models/a-1/files", "/import", "/jobs", "/drafts/new", "/tracks")
    for path in (*paths, "/compare?m=a-1&m=b-with-a-longer-name-1"):
        browser.open(address + path)
        wide[path] = browser.sideways()
    assert set(wide.values()) == {0}, wide
    assert [wide.split() for wide in browser.page.locator(".bar-side > :visible").all_inner_texts()] == [
        ["Garage"], ["Tracks"], ["Races"], ["Lessons"], ["More"]
    ]  # fmt: skip
    browser.page.focus(".bar-side .more")
    browser.press("Enter")
    browser.press("Tab")
    assert browser.value("document.activeElement.innerText").strip() == "Drive"
    entries = [entry.bounding_box() for entry in browser.page.locator(".bar-side :is(a, button):visible").all()]
    assert len(entries) > 8
    assert min(min(box["width"], box["height"]) for box in entries) >= 44
    assert min(box["y"] for box in entries) >= 0
    browser.press("Escape")
    assert not browser.page.is_visible("text=Drive")
    browser.page.tap(".bar-side .more")
    browser.page.tap("#more-pages :text('Settings')")
    browser.page.wait_for_url("**/settings")
    assert "here" in browser.page.get_attribute(".bar-side .more", "class")
    browser.show(768, 1024)
    browser.open(f"{address}/models")
    right = "document.querySelector('{}').getBoundingClientRect().right"
    assert browser.value(right.format(".models")) <= browser.value(right.format(".list")), "a tablet shows all of it"
    browser.close()

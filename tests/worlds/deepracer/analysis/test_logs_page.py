"""The page of a log in a real browser: episodes can be chosen, zoomed and stepped through; nothing is fetched."""

import base64
import io
import json
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from tests.browser import Browser, needs_chromium
from tests.worlds.deepracer.logs import makers

from racecraft.pages.parts import page as document
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.judged import best_lap_seconds, judged_in_log
from racecraft.worlds.deepracer.analysis.logs.page import MODULES, STYLES, Extras, _explorer, _headline, write_logs_page
from racecraft.worlds.deepracer.analysis.logs.page_data import _start_line, page_data
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.tracks.catalogue import load_track


@pytest.fixture(scope="module")
def ticks(tmp_path_factory):
    full = [makers.episode(k, 1.0, 46 + 15 * k, status="lap_complete") for k in range(3)]
    columns = makers.joined(*full, *(makers.episode(3 + k, 0.3) for k in range(20)))
    folder = tmp_path_factory.mktemp("log")
    makers.write(folder / "training-simtrace/0-iteration.csv", columns)
    makers.write(folder / "evaluation-20220709200242/evaluation-simtrace/0-iteration.csv", makers.lap_by_lap(2, 40))
    return read(folder).ticks.collect()


@pytest.fixture(scope="module")
def address(ticks, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "log.html"
    extras = Extras(("a.csv:7: X is 'east'",), reward=lambda params: 1.0)
    write_logs_page(path, ticks, load_track("reinvent_base"), "a <b> log", extras)
    return path.as_uri()


@pytest.fixture(params=[(1200, 900), (390, 844)], ids=["desk", "phone"])
def browser(request):
    yield from open_browser(*request.param)


@pytest.fixture
def desk():
    yield from open_browser()


def open_browser(*size):
    one = Browser(*size)
    yield one
    one.close()


def test_what_travels_to_the_page_comes_out_as_it_went_in(ticks):
    data = page_data(ticks, load_track("reinvent_base"))
    told = np.frombuffer(base64.b64decode(data["ticks"]["x_m"]), "<i2") * data["steps"]["x_m"]
    assert np.abs(told - ticks["x_m"].to_numpy()).max() <= 0.001 + 1e-9
    assert sum(data["episodes"]["ticks"]) == ticks.height
    assert data["left_out"] == 0
    assert json.loads(json.dumps(data, allow_nan=False))["track"]["closed"] is True


def test_of_many_steps_the_fast_and_the_late_ones_travel(ticks, monkeypatch):
    monkeypatch.setattr("racecraft.worlds.deepracer.analysis.logs.page_data.MAX_TICKS", 300)
    episodes = page_data(ticks, load_track("reinvent_base"))["episodes"]
    shown = [number for number, count in zip(episodes["unique_episode"], episodes["ticks"], strict=True) if count]
    assert {23, 24, 0, 1, 2} <= set(shown), "evaluations and full laps come first"
    assert 22 in shown, "then the latest"
    assert 3 not in shown


def test_the_best_lap_is_one_wherever_it_is_told(ticks):
    """The metrics know an evaluation whose steps nobody kept; its lap is the best of the page, in tile and advice."""
    metrics = pl.DataFrame(
        {"phase": ["training", "evaluation"], "round": 1, "stream": "", "iteration": 0, "progress_share": [0.4, 1.0],
         "seconds": [2.0, 1.25]}
    )  # fmt: skip
    assert "1.25 s" in _headline(ticks, metrics)
    assert judged_in_log(ticks, metrics).words().endswith("Its best lap took 1.25 s.")
    slower = metrics.with_columns(seconds=99.0)
    best = f"{best_lap_seconds(simulation_agg(ticks), slower):.2f} s"
    assert best in _headline(ticks, slower)
    assert judged_in_log(ticks, slower).words().endswith(f"Its best lap took {best}.")


def test_titles_and_damage_are_escaped_and_told(ticks, tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.worlds.deepracer.analysis.logs.page._section", lambda *section: iter(()))
    path = write_logs_page(tmp_path / "p.html", ticks, None, "a <b> log", Extras(("x.csv:7: X is '<script>'",)))
    text = path.read_text()
    assert "a &lt;b&gt; log" in text
    assert "X is &#39;&lt;script&gt;&#39;" in text
    assert "Name it with --track" in text


def test_every_plot_is_on_the_page(address):
    page = Path(address.removeprefix("file://")).read_text(encoding="utf-8")
    assert len(set(re.findall(r'data-plot="(\w+)"', page))) >= 33


@needs_chromium
def test_the_page_in_a_browser(browser, address):
    browser.open(address)
    browser.until("document.querySelectorAll('#rows tr').length === 25")
    told = "document.getElementById('told').textContent"
    assert browser.value(told).startswith("Episode 23 (evaluation"), "the fastest full lap is chosen"
    browser.value("document.querySelectorAll('#rows tr')[2].click()")
    first = browser.value(told)
    browser.value("document.getElementById('several').click(); document.querySelectorAll('#rows tr')[3].click()")
    assert browser.value(told).startswith(first + "; Episode")
    picture = "document.getElementById('map').toDataURL()"
    before = browser.value(picture)
    browser.value("document.getElementById('closer').click()")
    assert browser.value(picture) != before
    browser.value("document.getElementById('whole').click()")
    assert browser.value(picture) == before
    browser.value("document.getElementById('map').focus()")
    browser.press("ArrowRight")
    assert "step 1:" in browser.value(told)
    browser.press("ArrowRight")
    assert "step 2:" in browser.value(told)
    assert browser.value("document.documentElement.scrollWidth <= window.innerWidth"), "nothing sticks out sideways"
    assert browser.shut_out() == []
    assert browser.value("performance.getEntriesByType('resource').length") == 0
    assert browser.complaints == []


@needs_chromium
def test_pointing_at_a_path_reads_it_and_the_wheel_zooms(desk, address):
    desk.open(address)
    desk.until("document.querySelectorAll('#rows tr').length === 25")
    desk.value("document.getElementById('map').scrollIntoView()")
    box = desk.value("(r => [r.x, r.y, r.width, r.height])(document.getElementById('map').getBoundingClientRect())")
    shot = desk.value("document.getElementById('map').toDataURL()")
    x, y = brightest(shot)
    desk.page.mouse.move(box[0] + x, box[1] + y)
    desk.until("document.getElementById('told').textContent.includes('waypoint')")
    before = desk.value("document.getElementById('map').toDataURL()")
    desk.page.mouse.wheel(0, -300)
    desk.until(f"document.getElementById('map').toDataURL().length !== {len(before)}")
    assert desk.complaints == []


@needs_chromium
def test_the_map_is_as_high_as_its_road_and_pictures_can_be_read_on_a_phone(browser, address):
    browser.open(address)
    browser.until("document.querySelectorAll('#rows tr').length === 25")
    wide, high = browser.value("(r => [r.width, r.height])(document.getElementById('map').getBoundingClientRect())")
    x0, y0, x1, y1 = load_track("reinvent_base").bounds
    phone = browser.value("window.innerWidth") < 500
    if phone:
        assert wide / high == pytest.approx((x1 - x0 + 1.2) / (y1 - y0 + 1.2), rel=0.02), (
            "no empty ground above or below"
        )
    pictures = "[...document.querySelectorAll('.wide-picture')].filter(e => e.querySelector('.picture'))"
    plots = browser.value(f"{pictures}.map(e => [e.clientWidth, e.scrollWidth])")
    assert len(plots) > 5
    assert all(inside >= 600 and (inside > room) is phone for room, inside in plots), "pushed sideways, not shrunk"
    rows = browser.value("[...document.querySelectorAll('#rows tr')].map(e => e.getBoundingClientRect().height)")
    assert max(rows) < 45, "one line an episode"


@needs_chromium
def test_on_paper_what_can_only_be_clicked_is_left_out(desk, address):
    desk.open(address)
    desk.until("document.querySelectorAll('#rows tr').length === 25")
    desk.page.emulate_media(media="print")
    hidden = ".card > .tools, .list, details:not([open])"
    assert desk.value(f"[...document.querySelectorAll('{hidden}')].every(e => e.offsetHeight === 0)")


SPY = """
window.told = [];
const pen = CanvasRenderingContext2D.prototype, to = pen.moveTo, line = pen.lineTo;
let last = [0, 0];
pen.moveTo = function (x, y) { last = [x, y]; to.call(this, x, y); };
pen.lineTo = function (x, y) {
  window.told.push([this.lineWidth, ...last, x, y]); last = [x, y]; line.call(this, x, y);
};
"""


@needs_chromium
def test_the_map_tells_the_direction_and_draws_no_path_to_where_a_car_was_set_down(desk, tmp_path):
    track = load_track("reInvent2019_wide_cw")
    columns = makers.episode(0, 0.3, ticks=40, track=track)
    columns["X"][0] += 3.0
    ticks = read(makers.write(tmp_path / "training-simtrace" / "0-iteration.csv", columns)).ticks.collect()
    (tmp_path / "p.html").write_text(document("p", _explorer(ticks, track), modules=MODULES, styles=STYLES))
    desk.page.add_init_script(SPY)
    desk.open((tmp_path / "p.html").as_uri())
    desk.until("document.querySelectorAll('#rows tr').length === 1")
    told = np.array(desk.value("(window.told = [], document.getElementById('whole').click(), window.told)"))
    path, arrow = told[told[:, 0] == 3.0, 1:], told[np.isclose(told[:, 0], 1.6), 1:]
    assert len(path) == 38, "of 39 steps one was not driven"
    (x0, y0, x1, y1), yaw = arrow[0], track.pose_at(0.0).yaw
    assert np.cos(np.arctan2(y0 - y1, x1 - x0) - yaw) > 0.99, "screens count downwards"


def brightest(shot):
    """Return a pixel of a painted path on a picture of the map."""
    from PIL import Image

    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(shot.split(",")[1]))).convert("RGB")).astype(int)
    painted = (np.ptp(picture, axis=2) > 60) & (picture[..., 2] < 180)
    y, x = np.argwhere(painted)[painted.sum() // 2]
    return int(x), int(y)


def test_the_start_line_stands_across_the_road():
    """On Oval_track, whose rows do not lie opposite one another: within a degree of square to the road."""
    track = load_track("Oval_track")
    (x0, y0), (x1, y1) = _start_line(track)
    yaw = track.pose_at(0.0).yaw
    along = (x1 - x0) * np.cos(yaw) + (y1 - y0) * np.sin(yaw)
    assert abs(along) < np.hypot(x1 - x0, y1 - y0) * np.sin(np.radians(1.0))

"""A run served to browsers: every door of the API, and the page in a real browser."""

import io
import json
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from racecraft.contract.errors import UserInputError
from racecraft.formats.run_folder import RunFolder
from racecraft.serving.watch_server import WatchServer
from racecraft.web.ports import choose_port, is_free
from racecraft.worlds.deepracer.env.settings import BoxesConfig
from racecraft.worlds.deepracer.training import live
from racecraft.worlds.deepracer.training.live import LivePublisher

sys.path.append(str(Path(__file__).resolve().parents[1]))
from browser import Browser, needs_chromium  # noqa: E402
from kept_run import BOXES, drive, make_courses, make_run, make_world  # noqa: E402


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return make_run(tmp_path_factory.mktemp("runs") / "my-run")


@pytest.fixture
def address(run):
    server = WatchServer(run)
    yield server.start()
    server.close()


def ask(address, way):
    with urllib.request.urlopen(address + way, timeout=60) as answer:
        return answer.headers["Content-Type"], answer.read()


def told(address, way):
    return json.loads(ask(address, way)[1])


def test_every_door_answers(address):
    kind, page = ask(address, "")
    assert kind.startswith("text/html")
    assert b"<title>my-run" in page
    assert b"http://" not in page.replace(b"http://www.w3.org", b""), "nothing is fetched from elsewhere"
    assert b"https://" not in page
    assert told(address, "api/run")["name"] == "my-run"
    assert [row["iteration"] for row in told(address, "api/curves?after=2")["rows"]] == [3]
    assert told(address, "api/iterations") == {"iterations": [1, 2, 3]}
    reel = told(address, "api/iteration?number=3")
    one = reel["episodes"][0]
    way = f"api/episode?iteration=3&world={one['world']}&agent=0&episode={one['episode']}"
    assert told(address, way)["cars"][0]["tick"][0] == 1
    assert told(address, "api/live?after=0") == {"training": False, "reel": None}
    assert told(address, "api/track")["name"] == "reinvent_base"


def test_the_camera_looks_from_where_the_car_stands(address):
    world = make_world(1)
    buffers = drive(world, 12, [])
    x, y, yaw = (float(world.cars[name][0, 0]) for name in ("front_x", "front_y", "yaw"))
    kind, data = ask(address, f"policy.png?x={x}&y={y}&yaw={yaw}")
    seen = np.asarray(Image.open(io.BytesIO(data)))
    assert kind == "image/png"
    np.testing.assert_array_equal(seen, buffers.observations["FRONT_FACING_CAMERA"][0, 0])
    kind, data = ask(address, f"camera.jpg?x={x}&y={y}&yaw={yaw}")
    assert (kind, Image.open(io.BytesIO(data)).size) == ("image/jpeg", (320, 240))


def test_a_page_wishes_for_ticks_only_where_there_are_none_it_has_not(tmp_path, monkeypatch):
    """A wish makes the training keep and write ticks; what one page had written another is given without a wish."""
    monkeypatch.setattr(live, "LOOK_SECONDS", 0.0)
    run = make_run(tmp_path / "r", iterations=1)
    server = WatchServer(run)
    address = server.start()
    try:
        assert told(address, "api/live?after=0") == {"training": False, "reel": None}
        assert not run.watched.exists(), "nobody is there to hear a wish"
        with run.lock():
            publisher = LivePublisher(run)
            assert told(address, "api/live?after=0") == {"training": True, "reel": None}
            first = run.watched.stat().st_mtime_ns
            drive(make_world(), live.RING_TICKS + 1, [publisher])
            for _ in range(2):  # two pages
                assert told(address, "api/live?after=0")["reel"]["last"] == live.RING_TICKS + 1
            assert told(address, "api/live?after=40")["reel"]["first"] == 41
            assert run.watched.stat().st_mtime_ns == first, "they were given what there was"
            assert told(address, f"api/live?after={live.RING_TICKS + 1}")["reel"] is None
            assert run.watched.stat().st_mtime_ns > first
    finally:
        server.close()


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    return make_run(tmp_path_factory.mktemp("runs") / "several", iterations=1, several=True)


@pytest.fixture
def several_address(several):
    server = WatchServer(several)
    yield server.start()
    server.close()


def test_each_course_has_a_road_its_cars_and_its_objects(several_address):
    courses = told(several_address, "api/courses")["courses"]
    assert [(one["label"], one["first"], one["worlds"], len(one["objects"])) for one in courses] == [
        ("reinvent_base", 0, 2, 0),
        ("Oval_track boxes", 2, 2, 3),
        ("Oval_track reversed bots", 4, 1, 2),
    ]
    box, bot = courses[1]["objects"][0], courses[2]["objects"][0]
    assert (box["kind"], box["length"], box["width"]) == ("box_obstacle", 0.4, 0.3)
    assert (bot["kind"], bot["length"]) == ("bot_car", pytest.approx(0.32352))
    assert [told(several_address, f"api/track?course={k}")["name"] for k in range(3)] == [
        "reinvent_base",
        "Oval_track",
        "Oval_track",
    ]


def test_the_camera_shows_boxes_as_the_policy_saw_them(several_address):
    """By the world itself: the frame of a car before a box, pixel by pixel."""
    world = make_world(2, 1, "Oval_track", BOXES, BoxesConfig(number=3))
    buffers, seen_boxes = None, 0
    for seed in range(8):
        buffers = drive(world, 6, [], seed)
        for row in range(2):
            x, y, yaw = (float(world.cars[name][row, 0]) for name in ("front_x", "front_y", "yaw"))
            places = ";".join(",".join(map(repr, one)) for one in world.boxes[row, :, :3].tolist())
            way = f"?course=1&x={x!r}&y={y!r}&yaw={yaw!r}"
            frame = np.asarray(Image.open(io.BytesIO(ask(several_address, f"policy.png{way}&objects={places}")[1])))
            np.testing.assert_array_equal(frame, buffers.observations["FRONT_FACING_CAMERA"][row, 0])
            bare = np.asarray(Image.open(io.BytesIO(ask(several_address, f"policy.png{way}")[1])))
            if (bare != frame).any():
                seen_boxes += 1
                people = [ask(several_address, f"camera.jpg{way}{more}")[1] for more in ("", f"&objects={places}")]
                assert people[0] != people[1]
    assert seen_boxes > 2, "some boxes stood in sight"


@pytest.mark.parametrize(
    ("way", "status", "words"),
    [
        ("api/track?course=3", 404, "there is no course 3; expected 0 to 2"),
        ("camera.jpg?course=9&x=0&y=0&yaw=0", 404, "there is no course 9"),
        ("camera.jpg?course=1&x=0&y=0&yaw=0&objects=1,2", 400, "expected x,y,yaw of 3"),
        ("camera.jpg?course=1&x=0&y=0&yaw=0&objects=1,2,3;1,2,3;1,2,nan", 400, "objects is '1,2,3;"),
        ("camera.jpg?course=1&x=0&y=0&yaw=0&objects=a,b,c", 400, "objects is 'a,b,c'"),
    ],
)
def test_what_no_course_has_is_named(several_address, way, status, words):
    with pytest.raises(urllib.error.HTTPError) as refused:
        ask(several_address, way)
    assert refused.value.code == status
    assert words in json.loads(refused.value.read())["message"]


@pytest.mark.parametrize(
    ("way", "status", "words"),
    [
        ("nowhere", 404, "there is no /nowhere"),
        ("api/iteration?number=99", 404, "99.parquet: there is no such file"),
        ("api/iteration?number=-1", 400, "number is '-1'"),
        ("api/iteration", 400, "number is ''"),
        ("api/episode?iteration=1&world=0&agent=0&episode=77", 404, "has no episode 77"),
        ("camera.jpg?x=nan&y=0&yaw=0", 400, "x is 'nan'"),
        ("camera.jpg?x=1&y=1", 400, "yaw is ''"),
    ],
)
def test_what_cannot_be_answered_is_named(address, way, status, words):
    with pytest.raises(urllib.error.HTTPError) as refused:
        ask(address, way)
    assert refused.value.code == status
    assert words in json.loads(refused.value.read())["message"]


def test_other_runs_show_their_curves(tmp_path):
    other = RunFolder.create(tmp_path / "r", {"kind": "gymnasium", "title": "CartPole-v1", "asked": {"stops": []}})
    other.append_metrics({"iteration": 1, "mean_reward": 20.0})
    server = WatchServer(other)
    address = server.start()
    try:
        facts = told(address, "api/run")
        assert (facts["has_map"], facts["score_name"]) == (False, "return")
        assert "Gymnasium" in facts["instead"]
        assert told(address, "api/curves")["rows"] == [{"iteration": 1, "mean_reward": 20.0}]
        with pytest.raises(urllib.error.HTTPError):
            ask(address, "api/track")
    finally:
        server.close()


def test_a_taken_port_is_named_and_the_next_one_offered(run):
    server = WatchServer(run)
    taken = int(server.start().rsplit(":", 1)[1].strip("/"))
    try:
        assert not is_free(taken)
        port, note = choose_port(None, taken)
        assert port > taken
        assert note == f"port {taken} is taken; the page stands on {port}"
        with pytest.raises(UserInputError, match=f"127.0.0.1:{taken}: is taken or not allowed; --port {port} is free"):
            choose_port(taken, 8100)
    finally:
        server.close()


PAINTED = "new Set(pen.getImageData(0, 0, canvas.width, canvas.height).data).size"
"""How many different levels the map shows."""


@pytest.fixture
def browser(tmp_path):
    page = Browser(tmp_path / "browser", 1200, 1000)
    yield page
    assert page.complaints == []
    page.close()


@needs_chromium
def test_a_run_that_ended_is_played_in_a_browser(address, browser):
    browser.open(address)
    browser.until(
        "at.mode === 'iteration' && at.iteration === 3 && document.getElementById('eye').naturalWidth === 320"
    )
    assert browser.value("document.getElementById('live').disabled")
    assert browser.value("document.querySelectorAll('#cars button').length") == 3
    browser.until("at.head > 1")
    browser.press(" ")
    browser.until("!at.playing")
    browser.value("seek(5)")
    browser.press("ArrowRight")
    assert browser.value("at.head") == 6
    browser.press(",")
    browser.until("at.iteration === 2")
    browser.press("ArrowDown")
    assert browser.value("document.getElementById('driver').textContent") in ("Car 0", "Car 1")
    browser.value("document.querySelector('#episodes tr').click()")
    browser.until("at.mode === 'episode' && at.reel.cars.length === 1")
    browser.click("eyes")
    browser.until("document.getElementById('eye').naturalWidth === 16")
    assert browser.value(PAINTED) > 50, "the map is painted"
    assert browser.value("document.querySelectorAll('#scores polyline').length") == 2


@needs_chromium
def test_a_page_that_has_no_width_for_a_moment_plays_on(address, browser):
    """So it is while a window is laid out anew; nothing can be painted then, and the next picture comes."""
    browser.open(address)
    browser.until("at.mode === 'iteration' && at.head > 1")
    hide = "($('stage').hidden = {}, dispatchEvent(new Event('resize')))"
    browser.value(hide.format("true"))
    browser.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    browser.value(hide.format("false"))
    browser.value("seek(0), play(true)")
    browser.until("at.head > 2")
    assert browser.value(PAINTED) > 50, "the map is painted"


@needs_chromium
def test_behind_the_last_kept_iteration_comes_live_and_the_page_goes_on(address, browser):
    browser.open(address)
    browser.until("at.mode === 'iteration' && at.head > 1")
    browser.value("(was => { openLive = () => { went = true; was(); } })(openLive), at.run.training = true")
    browser.value("seek(at.reel.ticks - 1), play(true)")
    browser.until("window.went && at.mode === 'iteration'")  # the server says that the training is over
    browser.until("at.reel !== null && at.head > 1")


@needs_chromium
def test_the_page_is_read_on_a_phone(address, browser):
    browser.say("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=1, mobile=True)
    browser.open(address)
    browser.until("at.mode === 'iteration'")
    assert browser.value("document.documentElement.scrollWidth") == 390


@needs_chromium
def test_a_course_is_chosen_and_its_boxes_and_bots_stand_on_the_map(tmp_path, browser, monkeypatch):
    monkeypatch.setattr(live, "LOOK_SECONDS", 0.1)
    run = make_run(tmp_path / "several", iterations=1, several=True)
    server, over = WatchServer(run), threading.Event()

    def train():
        with run.lock():
            world, publisher, buffers = make_courses(), LivePublisher(run), None
            while not over.is_set():
                buffers = drive(world, 1, [publisher], int(time.time()), buffers)
                time.sleep(0.01)

    training = threading.Thread(target=train)
    training.start()
    try:
        browser.open(server.start())
        browser.until("at.mode === 'live' && at.reel !== null && at.head > 2")
        names = "JSON.stringify([...document.getElementById('course').options].map(one => one.textContent))"
        assert json.loads(browser.value(names)) == ["reinvent_base", "Oval_track boxes", "Oval_track reversed bots"]
        cars = "JSON.stringify([...document.querySelectorAll('#cars button')].map(one => one.name))"
        assert json.loads(browser.value(cars)) == ["0", "1"]
        assert browser.value("standing(at.reel.cars[0]).length") == 0
        browser.value("$('course').value = '1', $('course').onchange()")
        browser.until("at.track.name === 'Oval_track' && at.car === '2'")
        assert json.loads(browser.value(cars)) == ["2", "3"]
        browser.until("standing(at.reel.cars[2]).length === 3")
        browser.press(" ")  # stands still: the same moment on the map and in what is told
        brown = """(() => { drawMap(); return standing(at.reel.cars[2]).map(([x, y]) =>
            [...pen.getImageData(place.x(x), place.y(y), 1, 1).data].slice(0, 3).join()); })()"""
        painted = browser.value(brown)
        assert painted.count("123,97,79") >= 2, painted  # a car may just stand on one of them
        browser.press(" ")
        browser.value("$('course').value = '2', $('course').onchange()")
        browser.until("at.car === '4' && standing(at.reel.cars[4]).length === 2 && $('eye').naturalWidth === 320")
        first = browser.value("JSON.stringify(standing(at.reel.cars[4]))")
        browser.until(f"JSON.stringify(standing(at.reel.cars[4])) !== {json.dumps(first)}")
    finally:
        over.set()
        training.join()
        server.close()


PLAYED = """(() => {
    played = []; const own = begin;
    begin = (reel, ...more) => {
        if (at.reel && at.mode === "live")
            played.push({ left: at.reel.ticks - 1 - at.head, skipped: reel.first - at.reel.last - 1 });
        own(reel, ...more);
    };
    heads = []; const drawn = drawMap;
    drawMap = () => { heads.push([at.reel.last - at.reel.ticks + 1 + at.head, performance.now()]); drawn(); };
})()"""
"""Notes what was left to play whenever another reel began, and which tick was drawn when."""


@needs_chromium
def test_a_live_car_drives_on_without_a_halt_or_a_jump_inside_what_was_left(tmp_path, browser, monkeypatch):
    """Every reel is played to its end, and the next is there by then: the page asks in time."""
    run = make_run(tmp_path / "r", iterations=1)
    server, over = WatchServer(run), threading.Event()

    def train():
        with run.lock():
            world, publisher, buffers = make_world(), LivePublisher(run), None
            while not over.is_set():
                buffers = drive(world, 32, [publisher], int(time.time()), buffers)
                time.sleep(0.2)  # it learns

    training = threading.Thread(target=train)
    training.start()
    try:
        browser.open(server.start())
        browser.until("at.mode === 'live' && at.reel !== null")
        browser.value(PLAYED)
        browser.value("$('pace').value = '2', $('pace').onchange()")
        browser.until("played.length >= 3", 20.0)
        played = json.loads(browser.value("JSON.stringify(played)"))
        assert [one["left"] for one in played] == [0] * len(played), "nothing of a reel is cut off"
        assert all(one["skipped"] > 0 for one in played), "another moment: nothing was kept between the wishes"
        heads = np.array(json.loads(browser.value("JSON.stringify(heads)")))
        stood = np.diff(heads[:, 0]) == 0
        assert np.diff(heads[:, 1])[stood].sum() < 0.2 * (heads[-1, 1] - heads[0, 1]), "it hardly ever waits"
    finally:
        over.set()
        training.join()
        server.close()


@needs_chromium
def test_a_training_is_watched_live(tmp_path, browser, monkeypatch):
    monkeypatch.setattr(live, "LOOK_SECONDS", 0.1)
    run = make_run(tmp_path / "r", iterations=1)
    server = WatchServer(run)
    over = threading.Event()

    def train():
        with run.lock():
            world, publisher, buffers = make_world(), LivePublisher(run), None
            while not over.is_set():
                buffers = drive(world, 1, [publisher], int(time.time()), buffers)
                time.sleep(0.01)

    training = threading.Thread(target=train)
    training.start()
    try:
        browser.open(server.start())
        browser.until("at.mode === 'live' && at.reel !== null")
        first = browser.value("at.last")
        browser.until(f"at.last > {first} + 20 && at.head > 5")
        assert browser.value("document.getElementById('state-text').textContent") == "training"
        over.set()
        training.join()
        browser.until("at.mode === 'iteration' && document.getElementById('state-text').textContent === 'ended'")
    finally:
        over.set()
        training.join()
        server.close()

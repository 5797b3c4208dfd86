"""A run served to browsers: every door of the API, and the page in a real browser."""

import io
import json
import os
import sys
import threading
import time
import urllib.error
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from racecraft.contract.errors import UserInputError
from racecraft.formats.run_folder import RunFolder
from racecraft.serving.watch_server import NICENESS, WatchServer
from racecraft.web.ports import choose_port, is_free
from racecraft.worlds.deepracer.env.settings import BoxesConfig
from racecraft.worlds.deepracer.training import live
from racecraft.worlds.deepracer.training.live import LivePublisher

sys.path.append(str(Path(__file__).resolve().parents[1]))
from tests.browser import Browser, needs_chromium  # noqa: E402

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


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a niceness is a process's")
def test_the_page_waits_for_trainings_and_whoever_opened_it_does_not(address):
    ask(address, "api/run")
    serving = next(thread for thread in threading.enumerate() if thread.name == "racecraft-watch")
    assert os.getpriority(os.PRIO_PROCESS, serving.native_id) == min(19, os.nice(0) + NICENESS)


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
        ("camera.jpg?course=1&x=0&y=0&yaw=0&objects=1,2,3;1,2,3;1,2,nan", 400, "objects is '1,2,3;"),
    ],
)
def test_what_no_course_has_is_named(several_address, way, status, words):
    with pytest.raises(urllib.error.HTTPError) as refused:
        ask(several_address, way)
    with refused.value as answer:
        assert answer.code == status
        assert words in json.loads(answer.read())["message"]


@pytest.mark.parametrize(
    ("way", "status", "words"),
    [
        ("nowhere", 404, "There is no /nowhere"),
        ("api/iteration?number=99", 404, "99.parquet: there is no such file"),
        ("api/episode?iteration=1&world=0&agent=0&episode=77", 404, "has no episode 77"),
        ("camera.jpg?x=nan&y=0&yaw=0", 400, "x is 'nan'"),
    ],
)
def test_what_cannot_be_answered_is_named(address, way, status, words):
    with pytest.raises(urllib.error.HTTPError) as refused:
        ask(address, way)
    with refused.value as answer:
        assert answer.code == status
        assert words in json.loads(answer.read())["message"]


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
        with pytest.raises(urllib.error.HTTPError) as refused:
            ask(address, "api/track")
        refused.value.close()
        for name, kind in (("same", "gymnasium"), ("car", "deepracer")):
            beside = RunFolder.create(tmp_path / name, {"kind": kind, "title": name, "asked": {"stops": []}})
            beside.append_metrics({"iteration": 2, "mean_reward": 30.0})
        page = ask(address, "")[1].decode()
        assert ('value="same"' in page, 'value="car"' in page, 'value="r"' in page) == (True, False, False)
        assert told(address, "api/curves?run=same")["rows"] == [{"iteration": 2, "mean_reward": 30.0}]
        for name in ("car", "..", "../r", ""):
            with pytest.raises(urllib.error.HTTPError, match="404") as refused:
                ask(address, f"api/curves?run={name}")
            refused.value.close()
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


CARS = "const cars = document.querySelector('rc-cars'), { parts, map } = cars; "
"""What a test on the page begins with."""
LEVELS = "map.{}.getImageData(0, 0, map.canvas.width, map.canvas.height).data"
LEVELS_APART = f"{LEVELS.format('pen')}.filter((level, k) => level !== ground[k]).length / ground.length"
PAINTED = f"(ground => {LEVELS_APART})({LEVELS.format('ground')})"
"""Which share of the map is not bare ground."""


class Page(Browser):
    """A page with cars on it."""

    def cars(self, expression):
        """Return what an expression in `cars`, `parts` and `map` says."""
        return self.value(f"(() => {{ {CARS} return {expression}; }})()")

    def waits_for(self, expression, seconds=60.0):
        """Wait until such an expression says yes."""
        self.until(
            f"(() => {{ if (!document.querySelector('rc-cars')?.map) return; {CARS} return {expression}; }})()", seconds
        )


@pytest.fixture
def browser():
    page = Page(1200, 1000)
    yield page
    assert page.complaints == []
    page.close()


@needs_chromium
def test_a_run_that_ended_is_played_in_a_browser_and_shows_no_picture_before_there_is_one(address, browser):
    browser.page.route("**/camera.jpg*", lambda route: route.fulfill(status=503, body="{}"))
    browser.open(address)
    browser.waits_for("cars.mode === 'iteration' && cars.looked && !cars.looking")
    assert browser.cars("parts.eye.hidden")
    browser.page.unroute_all()
    browser.waits_for("cars.mode === 'iteration' && cars.iteration === 3 && parts.eye.width === 320")
    browser.complaints.clear()  # the refused pictures
    assert browser.cars("parts.live.disabled")
    assert browser.cars("parts.cars.children.length") == 3
    browser.waits_for("cars.head > 1")
    browser.press(" ")
    browser.waits_for("!cars.playing")
    browser.cars("cars.seek(5)")
    browser.press("ArrowRight")
    assert browser.cars("cars.head") == 6
    browser.press(",")
    browser.waits_for("cars.iteration === 2")
    browser.press("ArrowDown")
    browser.waits_for("['Car 0', 'Car 1'].includes(parts.driver.textContent)")
    browser.click("[data-part=episodes] button")
    browser.waits_for("cars.mode === 'episode' && cars.reel.cars.length === 1")
    browser.click("[data-part=eyes]")
    browser.waits_for("parts.eye.width === 16")
    assert 1e-4 < browser.cars(PAINTED) < 0.1, "cars on their ground"
    assert browser.value("document.getElementById('scores').columns.length") == 3


@needs_chromium
def test_a_page_that_has_no_width_for_a_moment_plays_on(address, browser):
    """So it is while a window is laid out anew; nothing can be painted then, and the next picture comes."""
    browser.open(address)
    browser.waits_for("cars.mode === 'iteration' && cars.head > 1")
    hide = "cars.style.display = '{}', new Promise(done => setTimeout(done, 200))"
    browser.cars(hide.format("none"))
    browser.cars(hide.format(""))
    browser.cars("(cars.seek(0), cars.play(true))")
    browser.waits_for("cars.head > 2")
    assert 1e-4 < browser.cars(PAINTED) < 0.1, "cars on their ground"
    wide = browser.cars("(cars.turn = () => {}, map.canvas.width)")
    browser.page.emulate_media(media="print")
    browser.waits_for(f"map.canvas.width !== {wide}")
    assert 1e-4 < browser.cars(PAINTED) < 0.1, "on paper no other picture follows"
    assert browser.cars("[parts.map, parts.eye, parts.kept].map(one => one.checkVisibility())") == [True, False, False]


@needs_chromium
def test_nothing_is_drawn_or_asked_while_the_page_is_hidden(address, browser):
    browser.open(address)
    browser.waits_for("cars.mode === 'iteration' && cars.head > 1")
    browser.value("Object.defineProperty(document, 'hidden', { value: true, configurable: true })")
    browser.value("document.dispatchEvent(new Event('visibilitychange'))")
    browser.waits_for("cars.sleeping")
    stood = browser.cars("cars.head")
    browser.page.wait_for_timeout(300)
    assert browser.cars("cars.head") == stood
    browser.value("delete document.hidden, document.dispatchEvent(new Event('visibilitychange'))")
    browser.waits_for(f"cars.head > {stood}")


@needs_chromium
def test_a_server_that_is_gone_is_said_within_five_seconds(run, browser):
    server = WatchServer(run)
    browser.open(server.start())
    browser.until("document.getElementById('state').textContent === 'ended'")
    server.close()
    browser.until("document.getElementById('state').textContent.includes('gone')", 5.0)
    browser.complaints.clear()  # Chromium prints every refused connection


@needs_chromium
def test_a_course_is_chosen_and_its_boxes_and_bots_stand_on_the_map(tmp_path, browser, monkeypatch):
    monkeypatch.setattr(live, "LOOK_SECONDS", 0.1)
    run = make_run(tmp_path / "several", iterations=1, several=True)
    with training(run, make_courses, 1, 0.01), served(run) as address:
        browser.open(address)
        browser.waits_for("cars.mode === 'live' && cars.reel !== null && cars.head > 2")
        names = "[...parts.course.options].map(one => one.textContent)"
        assert browser.cars(names) == ["reinvent_base", "Oval_track boxes", "Oval_track reversed bots"]
        listed = "[...parts.cars.children].map(one => one.name)"
        assert browser.cars(listed) == ["0", "1"]
        told = "(cars.reel.objects[cars.reel.cars[{0}].world] || [])"
        standing = f"({told}.findLast(([tick]) => tick <= cars.head) || [0, []])[1]"
        assert browser.cars(standing.format(0)) == []
        browser.cars("cars.chooseCourse(1)")
        browser.waits_for("cars.track.name === 'Oval_track' && cars.car === '2'")
        assert browser.cars(listed) == ["2", "3"]
        browser.waits_for(f"{standing.format(2)}.length === 3")
        browser.press(" ")  # stands still: the same moment on the map and in what is told
        browser.page.wait_for_timeout(100)
        pixel = "[...map.pen.getImageData(map.place.x(x), map.place.y(y), 1, 1).data].slice(0, 3).join()"
        painted = browser.cars(f"{standing.format(2)}.map(([x, y]) => {pixel})")
        assert painted.count("123,97,79") >= 2, painted  # a car may just stand on one of them
        browser.press(" ")
        browser.cars("cars.chooseCourse(2)")
        browser.waits_for(f"cars.car === '4' && {standing.format(4)}.length === 2 && parts.eye.width === 320")
        first = browser.cars(f"JSON.stringify({standing.format(4)})")
        browser.waits_for(f"JSON.stringify({standing.format(4)}) !== {json.dumps(first)}")


@needs_chromium
def test_a_training_is_watched_live(tmp_path, browser, monkeypatch):
    monkeypatch.setattr(live, "LOOK_SECONDS", 0.1)
    run = make_run(tmp_path / "r", iterations=1)
    with served(run) as address:
        with training(run, make_world, 1, 0.01):
            browser.open(address)
            browser.waits_for("cars.mode === 'live' && cars.reel !== null")
            first = browser.cars("cars.last")
            browser.waits_for(f"cars.last > {first} + 20 && cars.head > 5")
            assert browser.value("document.getElementById('state').textContent") == "training"
        browser.waits_for("cars.mode === 'iteration' && document.getElementById('state').textContent === 'ended'")


@contextmanager
def served(run):
    """Serve a run; yield the address."""
    server = WatchServer(run)
    try:
        yield server.start()
    finally:
        server.close()


@contextmanager
def training(run, make, ticks, pause):
    """Drive by chance in another thread, as a training does: some ticks, then a pause to learn."""
    over = threading.Event()

    def train():
        with run.lock():
            world, publisher, buffers = make(), LivePublisher(run), None
            while not over.is_set():
                buffers = drive(world, ticks, [publisher], int(time.time()), buffers)
                time.sleep(pause)

    thread = threading.Thread(target=train)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()

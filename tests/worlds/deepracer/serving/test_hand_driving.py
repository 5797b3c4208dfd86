"""A browser drives a lap through the real page, by keys alone."""

import json
import time

import pytest
from tests.browser import Browser, needs_chromium

from racecraft.formats.demonstrations import read_demonstrations
from racecraft.web.server import ServerThread
from racecraft.worlds.deepracer.serving.drive_server import make_drive_application

TRACK = "reinvent_base"
PILOT = """() => {
  const drive = document.querySelector("rc-drive"), centre = drive.track.centre;
  const key = (name, on) => { if (on !== drive.down.has(name)) document.body.dispatchEvent(
    new KeyboardEvent(on ? "keydown" : "keyup", { key: name, bubbles: true })); };
  setInterval(() => {
    if (!drive.shown) return;
    if (!drive.running) return key("ArrowUp", !drive.down.has("ArrowUp"));
    key("ArrowUp", false);
    const [x0, y0, yaw0, speed, wheel] = drive.to, turn = 3.8 * wheel * speed * 0.2;  // where it is in 0.2 s
    const yaw = yaw0 + turn, x = x0 + 0.2 * speed * Math.cos(yaw0 + turn / 2);
    const y = y0 + 0.2 * speed * Math.sin(yaw0 + turn / 2);
    const far = ([u, v]) => Math.hypot(u - x, v - y);
    let at = centre.reduce((best, point, k) => far(point) < far(centre[best]) ? k : best, 0), ahead = 1.0;
    while (ahead > 0) { const next = (at + 1) % centre.length;
      ahead -= Math.hypot(centre[next][0] - centre[at][0], centre[next][1] - centre[at][1]); at = next; }
    const off = Math.atan2(centre[at][1] - y, centre[at][0] - x) - yaw;
    const want = 2 * Math.atan2(Math.sin(off), Math.cos(off));
    key("ArrowLeft", want > 0.12 && drive.steer < want); key("ArrowRight", want < -0.12 && drive.steer > want);
  }, 16);
}"""


@pytest.fixture
def served(tmp_path):
    server = ServerThread(make_drive_application(TRACK, tmp_path / "car"), "drive")
    yield f"http://127.0.0.1:{server.start('127.0.0.1', 0)}/", tmp_path / "car"
    server.close()


@pytest.fixture
def browser():
    made = Browser(1000, 800)
    yield made
    made.close()


def until(page, script, seconds):
    """Wait until a script returns something true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if value := page.evaluate(script):
            return value
        time.sleep(0.1)
    raise AssertionError(f"{script}: not within {seconds} s")


@needs_chromium
@pytest.mark.long  # a lap takes 12 s by the clock
def test_a_lap_by_keys_is_kept_and_can_be_learned_from(served, browser):
    address, folder = served
    browser.open(address)
    page = browser.page
    until(page, "() => !!document.querySelector('rc-drive').view", 20)
    page.evaluate(PILOT)
    laps = until(page, "() => document.querySelector('rc-drive').laps.length", 90)
    assert laps == 1
    assert read_demonstrations(folder / f"laps-{TRACK}.safetensors").num_episodes == 1
    assert "--from=" in page.evaluate("() => document.querySelector('[data-part=command]').textContent")
    delays = page.evaluate("() => document.querySelector('rc-drive').delays")
    assert sorted(delays)[len(delays) // 2] < 120
    assert browser.shut_out() == []
    assert browser.complaints == []


@needs_chromium
def test_gas_starts_the_car_and_pause_stops_it(served, browser):
    address, _ = served
    browser.open(address)
    page = browser.page
    until(page, "() => !!document.querySelector('rc-drive').view", 20)
    page.keyboard.down("ArrowUp")
    until(page, "() => document.querySelector('rc-drive').to[3] > 1", 10)
    page.keyboard.press("p")
    time.sleep(0.3)
    stood = page.evaluate("() => document.querySelector('rc-drive').to")
    time.sleep(0.3)
    assert page.evaluate("() => document.querySelector('rc-drive').to") == stood
    assert page.evaluate("() => document.querySelector('[data-part=call]').textContent").startswith("Paused")
    assert browser.complaints == []


def test_nonsense_from_a_page_is_passed_over(served):
    from websockets.sync.client import connect

    address, _ = served
    with connect(f"{address.replace('http', 'ws')}wheel") as socket:
        told = [json.loads(socket.recv()) for _ in range(3)]
        assert [next(iter(one)) for one in told] == ["track", "laps", "ghost"]
        for text in ("{", "[]", '{"steer": "left", "gas": null}', '{"drop": 99}', '{"ghost": "who"}'):
            socket.send(text)
        socket.send('{"go": true, "steer": 0, "gas": 1, "n": 7}')
        while "at" not in (one := json.loads(socket.recv(timeout=60))):
            pass
        assert one["n"] in (0, 7)


def test_pages_of_other_sites_drive_nothing(served):
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    address, _ = served
    with pytest.raises(InvalidStatus):
        connect(f"{address.replace('http', 'ws')}wheel", origin="http://elsewhere.example")

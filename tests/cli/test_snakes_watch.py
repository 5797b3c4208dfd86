"""`racecraft snakes watch`, `film`, and the ways of `play` to be watched, as a user types them."""

import json
import signal
import sys
import time
import urllib.request
from urllib.parse import parse_qs, urlsplit

import pytest
from tests.forked import Begun, ran

GAME = ("-u", "flood_fill", "-u", "hungry", "-W", 7, "-H", 7, "-r", 5)


@pytest.fixture
def game(racecraft):
    """Play a game into game.jsonl; return what was said."""
    return racecraft("snakes", "play", *GAME, "-n", "Flo", "-o", "game.jsonl", "--json")


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A browser that is none: it notes the address it is asked to open."""
    path = tmp_path / "browser.py"
    path.write_text(f"#!{sys.executable}\nimport sys\nopen({str(tmp_path / 'opened')!r}, 'a').write(sys.argv[1])\n")
    path.chmod(0o755)
    return f"{path} %s"


def test_a_recorded_game_becomes_a_page(racecraft, game, tmp_path):
    said = racecraft("snakes", "watch", "game.jsonl", "--html", "game.html", "--json")
    assert (said.code, json.loads(said.out)) == (0, {"html": "game.html"})
    told = json.loads((tmp_path / "game.html").read_text().split('type="application/json">')[1].split("</script>")[0])
    assert told["title"] == "Flo – hungry"
    assert told["live"] == ""
    assert len(told["events"]) == json.loads(game.out)["turns"] + 2
    deaths = [snake["Death"] for snake in told["events"][-2]["Data"]["Snakes"]]
    assert [death["Cause"] != "eliminated" for death in deaths if death] == [True], "our own files tell the cause"


def test_a_game_of_the_official_engine_is_watched_too(racecraft, game, tmp_path):
    """Its last line has three keys and no causes; who left is still seen to have left."""
    lines = (tmp_path / "game.jsonl").read_text().splitlines()
    last = {key: value for key, value in json.loads(lines[-1]).items() if key != "eliminations"}
    (tmp_path / "game.jsonl").write_text("\n".join([*lines[:-1], json.dumps(last)]))
    assert racecraft("snakes", "watch", "game.jsonl", "--html", "game.html").code == 0
    told = json.loads((tmp_path / "game.html").read_text().split('type="application/json">')[1].split("</script>")[0])
    deaths = [snake["Death"] for snake in told["events"][-2]["Data"]["Snakes"] if snake["Death"]]
    assert deaths == [{"Cause": "eliminated", "Turn": json.loads(game.out)["turns"], "EliminatedBy": ""}]


def test_a_recorded_game_is_served_until_it_is_interrupted(game, tmp_path, desk):
    opened = tmp_path / "opened"
    with Begun(["snakes", "watch", "game.jsonl", "--json"], tmp_path, BROWSER=desk) as served:
        url = json.loads(served.stdout.readline())["url"]
        with urllib.request.urlopen(url, timeout=60) as answer:
            assert "Flo – hungry" in answer.read().decode()
        until = time.monotonic() + 60
        while not (opened.exists() and opened.read_text()) and time.monotonic() < until:
            time.sleep(0.02)
        served.send_signal(signal.SIGINT)
        assert served.wait(60) == 0
    assert opened.read_text() == url


def test_a_live_game_is_played_at_a_pace_one_can_watch(tmp_path, desk):
    command = ["snakes", "watch", "--live", "-u", "hungry", "-W", "7", "-H", "7", "--no-open", "--json"]
    with Begun(command, tmp_path, BROWSER=desk) as served:
        url = json.loads(served.stdout.readline())["url"]
        with urllib.request.urlopen(f"{url}", timeout=60) as answer:
            assert '"live":"/games/racecraft-' in answer.read().decode()
        served.send_signal(signal.SIGINT)
        assert served.wait(60) in (0, 130), "over and waiting, or in the middle of the game"
    assert not (tmp_path / "opened").exists()


OFFICIAL_VIEWER = """
import json, sys, urllib.request
from urllib.parse import parse_qs, urlsplit
from websockets.sync.client import connect
asked = parse_qs(urlsplit(sys.argv[1]).query)
engine, game = asked["engine"][0], asked["game"][0]
with urllib.request.urlopen(f"{engine}/games/{game}") as answer:
    facts = json.load(answer)["Game"]
address = engine.replace("http", "ws") + f"/games/{game}/events"
with connect(address, origin="https://board.example") as wire:
    heard = [json.loads(message)["Type"] for message in wire]
with open(sys.argv[2], "w") as file:
    json.dump({"facts": facts, "heard": heard, "address": sys.argv[1]}, file)
"""


def test_play_opens_the_board_page_that_was_asked_for_and_waits_for_it(tmp_path):
    """As the official CLI: `--board-url/?engine=…&game=…`, then the board's protocol until the game is over."""
    (tmp_path / "viewer.py").write_text(OFFICIAL_VIEWER)
    viewer = f"{sys.executable} viewer.py %s seen.json"
    command = ["snakes", "play", *map(str, GAME), "--browser", "--board-url", "http://board.example/", "--json"]
    done = ran(command, tmp_path, BROWSER=viewer)
    assert done.returncode == 0, done.stderr
    seen = json.loads((tmp_path / "seen.json").read_text())
    assert seen["heard"] == ["frame"] * (json.loads(done.stdout)["turns"] + 1) + ["game_end"]
    assert (seen["facts"]["ID"], seen["facts"]["Width"]) == ("racecraft-5", 7)
    parts = urlsplit(seen["address"])
    assert (parts.netloc, parse_qs(parts.query)["autoplay"]) == ("board.example", ["true"])


def test_play_does_not_wait_for_ever_for_a_browser(racecraft, monkeypatch):
    monkeypatch.setattr("racecraft.worlds.battlesnake.serving.spectators.SECONDS_FOR_A_BROWSER", 0.1)
    monkeypatch.setattr("webbrowser.open", lambda address: False)
    said = racecraft("snakes", "play", *GAME, "--browser", "--most-turns", 2)
    assert said.code == 0
    assert "Watch it at http://127.0.0.1:" in said.err
    assert "No browser could be opened" in said.err
    assert "No browser came within 0.1 s" in said.err


def test_colours_are_forced_or_left_out(racecraft):
    watched = ("snakes", "play", *GAME, "--viewmap", "--most-turns", 2, "-D", 1)
    assert "\x1b[" in racecraft(*watched, "--color").out
    plain = racecraft(*watched, "--no-color").out
    assert "\x1b[" not in plain
    assert "A flood_fill" in plain
    assert ".B.a." in plain


def test_delay_and_duration_keep_the_pace(racecraft):
    for flag, least in (("--delay", 0.3), ("--duration", 0.3)):
        begin = time.monotonic()
        assert racecraft("snakes", "play", *GAME, flag, 100, "--most-turns", 3).code == 0
        assert time.monotonic() - begin >= least, flag


@pytest.mark.parametrize(
    ("flags", "key", "value"),
    [
        (("--minimumFood", 3), ("ruleset", "settings", "minimumFood"), 3),
        (("--shrinkEveryNTurns", 7), ("ruleset", "settings", "royale", "shrinkEveryNTurns"), 7),
        (("--timeout", 77), ("timeout",), 77),
    ],
)
def test_what_a_flag_says_stands_in_the_output_file(racecraft, tmp_path, flags, key, value):
    assert racecraft("snakes", "play", *GAME, *flags, "--most-turns", 1, "-o", "game.jsonl").code == 0
    first, turn = (json.loads(line) for line in (tmp_path / "game.jsonl").read_text().splitlines()[:2])
    assert turn["game"] == first
    for name in key:
        first = first[name]
    assert first == value


def test_a_game_is_filmed(racecraft, tmp_path):
    assert racecraft("snakes", "play", *GAME, "--most-turns", 3, "-o", "game.jsonl").code == 0
    said = racecraft("snakes", "film", "game.jsonl", "--out", "game.mp4", "--speed", 32)
    assert (said.code, said.out) == (0, "game.mp4\n")
    assert (tmp_path / "game.mp4").read_bytes()[4:8] == b"ftyp"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("watch",), "--live"),
        (("watch", "game.jsonl", "--live"), "--live"),
        (("watch", "no.jsonl", "--html", "no/where.html"), "no/where.html"),
        (("film", "no.jsonl", "--out", "game.avi"), "game.avi"),
    ],
)
def test_what_cannot_be_watched_is_said_with_exit_code_2(racecraft, arguments, words):
    said = racecraft("snakes", *arguments)
    assert said.code == 2, said
    assert words in said.err
    assert "Traceback" not in said.err


@pytest.mark.parametrize("where", ["boards differ", "cut"])
def test_records_that_are_none_are_refused(racecraft, game, tmp_path, where):
    lines = (tmp_path / "game.jsonl").read_text().splitlines()
    if where == "boards differ":
        lines[2] = lines[2].replace('"width":7', '"width":8')
    else:
        lines[3] = lines[3][:50]
    (tmp_path / "game.jsonl").write_text("\n".join(lines))
    said = racecraft("snakes", "watch", "game.jsonl", "--html", "game.html")
    assert said.code == 2
    assert "game.jsonl" in said.err
    assert not (tmp_path / "game.html").exists()

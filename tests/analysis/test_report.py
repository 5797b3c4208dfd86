"""The page of a run holds its numbers, fetches nothing, and says plainly what it cannot tell."""

import base64
import io
import json
import re
from html.parser import HTMLParser

import av
import numpy as np
import pytest
from tests.browser import Browser, needs_chromium

from racecraft.analysis import page
from racecraft.analysis.figures import FigureError
from racecraft.analysis.report import write_report
from racecraft.analysis.run_facts import ReportError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.report_parts import console_cost
from racecraft.worlds.deepracer.env import race

FETCHING = ("src", "href", "srcset", "poster", "data", "action", "xlink:href")


class Reader(HTMLParser):
    """Collects what a browser would fetch, the words of the page, and tags that were never closed."""

    def __init__(self):
        super().__init__()
        self.fetched, self.words, self.open = [], [], []

    def handle_starttag(self, tag, attrs):
        self.fetched += [value for name, value in attrs if name in FETCHING]
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.fetched += [value for name, value in attrs if name in FETCHING]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


@pytest.fixture
def run(tmp_path, track, reports_along):
    """A run of three iterations: a car that left the road at 40 %, then lapped."""
    job = {
        "kind": "deepracer",
        "asked": {"track": track.name, "preset": "fast", "stops": ["laps"], "folder": None},
        "track": {"name": track.name, "hash": track.hash()},
        "settings": {"ppo": {"learning_rate": 0.0005}, "race": {"car": "v6"}},
        "seed": 7,
        "versions": {"racecraft": "0.1.0"},
    }
    run = RunFolder.create(tmp_path / "try <1>", job)
    for k in (1, 2, 3):
        run.append_metrics(
            {
                "iteration": k, "steps": 9600 * k, "seconds": 2.0 * k, "episodes": k, "training_score": 20.0 * k,
                "evaluation_score": 30.0 * k, "best_lap_seconds": 12.34 if k == 3 else None, "entropy": 2.0,
            }
        )  # fmt: skip
        Checkpoints(run.checkpoints).save(k, 9600 * k, {}, {}, score=30.0 * k, best=True)
        laps = [{"seconds": 12.34 if k == 3 else None, "status": "lap_complete"}] * 5
        judged = {"laps": laps, "full_laps": 5 * (k == 3), "mean_progress_percent": 30.0 * k}
        (run.evaluations / f"{k}.json").write_text(json.dumps({**judged, "best_lap_seconds": laps[0]["seconds"]}))
    run.reward_function.write_text("def reward_function(params):\n    return 1.0 if params['x'] < 2 else 0\n")
    for k, reports in ((1, reports_along(20, race.OFF_TRACK, share=0.4)), (2, reports_along(45))):
        write_episodes(
            run.episodes / f"{k}.parquet",
            {
                "episode": np.full(len(reports), k - 1), "world": np.zeros(len(reports)),
                "iteration": np.full(len(reports), k), "tick": reports["steps"], "time_s": reports["lap_seconds"],
                "x_m": reports["front_x"], "y_m": reports["front_y"], "yaw_rad": reports["yaw"],
                "steering_rad": reports["steering"], "speed_mps": reports["speed"],
                "velocity_mps": reports["driven_speed"], "action": np.arange(len(reports)) % 3,
                "reward": np.ones(len(reports)), "done": reports["terminated"],
                "status": np.array(race.STATUSES)[reports["status"]], "progress_share": reports["progress"] / 100,
                "closest_waypoint": np.arange(len(reports)),
            },
        )  # fmt: skip
    return run


def test_the_page_holds_the_numbers_and_fetches_nothing(run, tmp_path):
    text = write_report(run, tmp_path / "report.html").read_text(encoding="utf-8")
    reader = Reader()
    reader.feed(text)
    assert reader.open == []
    assert reader.fetched
    assert [at for at in reader.fetched if not at.startswith(("data:", "#"))] == []
    assert re.findall(r"https?://|url\((?!#)|@import|<script", text) == []
    words = " ".join(reader.words)
    for expected in ("re:Invent 2018", "run try <1>", "12.34 s", "28,800", "5 of 5", "90.0 %", "ppo.learning_rate"):
        assert expected in words
    assert "28,800 steps ÷ 8 steps a second ÷ 3,600 = 1.00 h; 1.00 h × 3.50 USD an hour" in words
    assert "3.50 USD" in words
    assert text.count("<img") == 2
    assert 'alt="Best training episode: lap complete 3.00 s"' in text


@needs_chromium
def test_the_page_is_read_on_a_phone(run, tmp_path, reports_along):
    """390 px: nothing is cut off or pushed aside, the page's own words are 12 px and more, pictures fill the width."""
    page = write_report(run, tmp_path / "report.html", reports_along(30))
    browser = Browser(tmp_path / "profile")
    try:
        browser.say("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=1, mobile=True)
        browser.open(page.as_uri())
        assert browser.value("document.documentElement.scrollWidth") == 390
        wide = (
            "[...document.querySelectorAll('body *')].filter(one => one.getBoundingClientRect().right > 390.5).length"
        )
        assert browser.value(wide) == 0
        words = "[...document.querySelectorAll('body p, body td, body th, body h1, body h2, body summary, body code')]"
        assert browser.value(f"Math.min(...{words}.map(one => parseFloat(getComputedStyle(one).fontSize)))") >= 12
        assert browser.value("Math.min(...[...document.images].map(one => one.getBoundingClientRect().width))") > 280
    finally:
        browser.close()


def test_a_drive_of_the_best_policy_takes_the_place_of_the_training_episode(run, tmp_path, reports_along):
    text = write_report(run, tmp_path / "report.html", reports_along(30)).read_text(encoding="utf-8")
    assert 'alt="The best policy: lap complete 2.00 s"' in text


def test_the_best_lap_is_that_of_the_best_checkpoint_and_not_of_another(run, tmp_path):
    """Iteration 2 gets a quicker lap among bad ones; what `RUN:best` drives is iteration 3."""
    rows = run.read_metrics()
    run.cut_metrics(0)
    for row in rows:
        run.append_metrics({**row, "best_lap_seconds": {2: 9.87, 3: 12.34}.get(row["iteration"])})
    words = words_of(write_report(run, tmp_path / "report.html"))
    assert "90.0 % best checkpoint, mean progress 12.34 s its best lap in evaluation" in words
    Checkpoints(run.checkpoints).mark(2, 60.0, best=True)
    words = words_of(write_report(run, tmp_path / "report.html"))
    assert "60.0 % best checkpoint, mean progress 9.87 s its best lap in evaluation" in words


def words_of(path):
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    return " ".join(" ".join(reader.words).split())


def test_the_reward_function_stands_on_the_page_as_it_was_written(run, tmp_path):
    text = write_report(run, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<pre><code>def reward_function(params):\n    return 1.0 if params[&#x27;x&#x27;] &lt; 2 else 0" in text


def test_the_mean_reward_is_told_and_drawn_unless_it_is_the_score_itself(run, tmp_path):
    rows = run.read_metrics()
    run.cut_metrics(0)
    for row in rows:
        run.append_metrics({**row, "mean_reward": 7.5 * row["iteration"]})
    path = write_report(run, tmp_path / "report.html")
    assert "An episode was paid 22.5 in the mean" in words_of(path)
    assert 'aria-label="mean reward of an episode"' in path.read_text(encoding="utf-8")
    run.cut_metrics(0)
    for row in rows:
        run.append_metrics({**row, "mean_reward": row["training_score"]})
    path = write_report(run, tmp_path / "report.html")
    assert 'aria-label="mean reward of an episode"' not in path.read_text(encoding="utf-8")


def test_an_exit_counts_once_in_every_place_that_counts_exits(run, tmp_path):
    words = words_of(write_report(run, tmp_path / "report.html"))
    assert "Where cars left the road in training : once, a cross each." in words
    assert "How 2 training episodes ended" in words
    assert "off track 1 50.0 %" in words
    assert "mean speed (m/s) 19 1 " in words, "waypoint 19, one exit"


def test_a_film_travels_inside_the_page(run, tmp_path, reports_along, track):
    from racecraft.analysis.video import SMALL_HEIGHT, SMALL_WIDTH, film_title, small_film
    from racecraft.worlds.deepracer.analysis.lap_film import write_video

    large = write_video(tmp_path / "lap.mp4", reports_along(12), track, title="checkpoint 3")
    assert film_title(large) == "checkpoint 3"
    small = small_film(large)
    assert len(small) < large.stat().st_size / 2
    text = write_report(run, tmp_path / "report.html", reports_along(12), small).read_text(encoding="utf-8")
    sent = base64.b64decode(re.search(r'<video[^>]* src="data:video/mp4;base64,([^"]+)"', text)[1])
    with av.open(io.BytesIO(sent)) as film, av.open(str(large)) as whole:
        (stream,) = film.streams.video
        assert (stream.width, stream.height) == (SMALL_WIDTH, SMALL_HEIGHT)
        assert stream.frames == whole.streams.video[0].frames
        assert film.duration == pytest.approx(whole.duration, rel=0.01)


def test_what_is_no_film_has_no_title_and_is_refused(tmp_path):
    from racecraft.analysis.video import VideoError, film_title, small_film

    (tmp_path / "lap.mp4").write_text("no film")
    assert (film_title(tmp_path / "lap.mp4"), film_title(tmp_path / "none.mp4")) == ("", "")
    with pytest.raises(VideoError, match=r"lap\.mp4: is no film"):
        small_film(tmp_path / "lap.mp4")


def test_a_run_without_episodes_evaluations_or_a_known_track_still_has_a_page(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "gym", "settings": {}})
    run.append_metrics({"iteration": 1, "steps": 10, "seconds": 0.5, "training_score": -3.0})
    text = write_report(run, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "return (sum of rewards)" in text
    assert "<img" not in text
    assert "USD" not in text


def test_a_snakes_page_tells_its_rating_and_whom_it_beat(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "battlesnake", "title": "snakes: duel", "settings": {}})
    run.append_metrics({"iteration": 1, "steps": 10, "seconds": 0.5, "training_score": None})
    run.append_metrics({"iteration": 2, "steps": 20, "seconds": 1.0, "evaluation_score": 1606.94})
    against = {"hungry": {"games": 50, "won": 21}, "flood_fill": {"games": 50, "won": 15}}
    rating = {"rating": 1606.94, "rating_low": 1557.1, "rating_high": 1656.7, "against": against}
    (run.evaluations / "2.json").write_text(json.dumps(rating))
    Checkpoints(run.checkpoints).save(2, 20, {}, {}, score=1606.94, best=True)
    reader = Reader()
    reader.feed(write_report(run, tmp_path / "report.html").read_text(encoding="utf-8"))
    words = " ".join(reader.words)
    for expected in (
        "snakes: duel",
        "1607 best checkpoint, rating",
        "rating (Elo)",
        "1557 to 1657",
        "won against hungry",
        "15 of 50",
    ):
        assert expected in words
    assert "sum of rewards" not in words


def test_a_page_of_returns_names_what_counts_as_solved(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "gymnasium", "title": "CartPole-v1", "settings": {}})
    run.append_metrics({"iteration": 8, "steps": 10, "seconds": 0.5, "evaluation_score": 23.34})
    told = {"episodes": 20, "mean_return": 23.34, "std_return": 4.29, "mean_steps": 23.3, "threshold": 475.0}
    (run.evaluations / "8.json").write_text(json.dumps(told))
    Checkpoints(run.checkpoints).save(8, 10, {}, {}, score=23.34, best=True)
    reader = Reader()
    reader.feed(write_report(run, tmp_path / "report.html").read_text(encoding="utf-8"))
    words = " ".join(reader.words)
    for expected in ("CartPole-v1", "23.34 best checkpoint, mean return", "A mean of 475 counts as solved", "4.29"):
        assert expected in words


def test_a_run_that_was_not_judged_has_a_page_without_an_empty_chart(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "battlesnake", "settings": {}})
    run.append_metrics({"iteration": 1, "steps": 10, "seconds": 0.5, "entropy": 0.5})
    text = write_report(run, tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.count("<svg") == 1, "the entropy alone"


def test_another_track_of_the_same_name_is_not_drawn(run, tmp_path):
    job = run.read_job()
    run.write_job({**job, "track": {**job["track"], "hash": "0" * 12}})
    assert "<img" not in write_report(run, tmp_path / "report.html").read_text(encoding="utf-8")


def test_bad_folders_are_answered_in_letters(run, tmp_path):
    (run.evaluations / "2.json").write_text("{")
    with pytest.raises(ReportError, match=r"2\.json: cannot be read .*expected an evaluation"):
        write_report(run, tmp_path / "report.html")
    with pytest.raises(FigureError, match="no metrics yet"):
        write_report(RunFolder.create(tmp_path / "new"), tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


def test_the_console_billed_by_the_hour_of_steps():
    assert console_cost(57_600) == (2.0, 7.0)  # 57,600 / 8 = 7,200 s


def test_cells_are_escaped_but_bars_are_drawn():
    drawn = page.table(("a<b", ""), [("<i>", page.Bar(0.5))], (0,))
    assert '<th class="right">a&lt;b</th>' in drawn
    assert "&lt;i&gt;" in drawn
    assert 'style="width:50.0%"' in drawn

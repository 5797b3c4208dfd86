"""The page of a car's run holds its numbers, fetches nothing, and says plainly what it cannot tell."""

import base64
import io
import json
import re

import av
import numpy as np
import pytest
from tests.browser import Browser, needs_chromium
from tests.page_reader import Reader, words_of

from racecraft.analysis.report import write_report
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.drive import as_drive
from racecraft.worlds.deepracer.analysis.report import car_parts
from racecraft.worlds.deepracer.env import race


@pytest.fixture
def run(tmp_path, track, reports_along):
    """A run of three iterations: a car that left the road at 40 %, then lapped."""
    job = {
        "kind": "deepracer",
        "asked": {"track": track.name, "preset": "fast", "stops": ["laps"], "folder": None},
        "track": {"name": track.name, "hash": track.hash()},
        "settings": {"ppo": {"learning_rate": 0.0005}, "race": {"car": "v6"}},
        "model_metadata": {"action_space": [{"steering_angle": angle, "speed": 2.5} for angle in (-30, 0, 30)]},
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


def write(run, tmp_path, drive=None, film=None):
    """Write the page of a run; what its best policy drives is given, not driven."""
    shown = None if drive is None else as_drive(drive)
    return write_report(run, tmp_path / "report.html", of_world=lambda facts: car_parts(facts, shown, film))


def test_the_page_holds_the_numbers_and_fetches_nothing(run, tmp_path):
    text = write(run, tmp_path).read_text(encoding="utf-8")
    reader = Reader()
    reader.feed(text)
    assert reader.open == []
    assert reader.fetched
    assert [at for at in reader.fetched if not at.startswith(("data:", "#"))] == []
    assert re.findall(r"https?://(?!www.w3.org)|url\((?!#|\"data:)|@import", text) == []
    words = " ".join(reader.words)
    for expected in ("re:Invent 2018", "run try <1>", "12.34 s", "28,800", "5 of 5", "90.0 %", "ppo.learning_rate"):
        assert expected in words
    assert "28,800 steps ÷ 8 steps a second ÷ 3,600 = 1.00 h of simulation: 1 h 0 min of training" in words
    assert "About 4.10 USD on AWS." in words  # 0.60 + 6 x 0.40 + 1.00 + 10 x 0.010
    assert "one price, 3.50 USD an hour: 3.50 USD" in words
    assert text.count("<img") == 2
    assert 'alt="Best training episode: lap complete 3.00 s"' in text


@needs_chromium
def test_the_page_is_read_on_a_phone(run, tmp_path, reports_along):
    """390 px: nothing is cut off or pushed aside, the page's own words are 12 px and more, pictures fill the width."""
    page = write(run, tmp_path, reports_along(30))
    browser = Browser()
    try:
        browser.show(390, 844)
        browser.open(page.as_uri())
        assert browser.value("document.documentElement.scrollWidth") == 390
        assert browser.shut_out() == []
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
    text = write(run, tmp_path, reports_along(30)).read_text(encoding="utf-8")
    assert 'alt="The best policy: lap complete 2.00 s"' in text


def test_the_best_lap_is_that_of_the_best_checkpoint_and_not_of_another(run, tmp_path):
    """Iteration 2 gets a quicker lap among bad ones; what `RUN:best` drives is iteration 3."""
    rows = run.read_metrics()
    run.cut_metrics(0)
    for row in rows:
        run.append_metrics({**row, "best_lap_seconds": {2: 9.87, 3: 12.34}.get(row["iteration"])})
    words = words_of(write(run, tmp_path))
    assert "90.0 % best checkpoint, mean progress 12.34 s its best lap in evaluation" in words
    Checkpoints(run.checkpoints).mark(2, 60.0, best=True)
    words = words_of(write(run, tmp_path))
    assert "60.0 % best checkpoint, mean progress 9.87 s its best lap in evaluation" in words


def test_the_first_lap_and_the_fastest_stand_beside_each_other_and_the_best_known_one(run, tmp_path):
    """v6 to 2.5 m/s is known to lap re:Invent 2018 in 85 ticks of 1/15 s; 93.5 are a tenth more."""
    rows = run.read_metrics()
    run.cut_metrics(0)
    for row, lap in zip(rows, (12.34, None, 9.87), strict=True):
        run.append_metrics({**row, "best_lap_seconds": lap, "flying_lap_seconds": lap and 93.5 / 15})
    words = words_of(write(run, tmp_path))
    assert "first full lap, from rest 12.34 s fastest lap, from rest 9.87 s faster by 2.47 s" in words
    assert "fastest flying lap 6.23 s best known lap 5.67 s gap +10.0 %" in words


def test_the_reward_function_stands_on_the_page_as_it_was_written(run, tmp_path):
    text = write(run, tmp_path).read_text(encoding="utf-8")
    assert "<code>def reward_function(params):\n    return 1.0 if params[&#39;x&#39;] &lt; 2 else 0" in text


def test_an_exit_counts_once_in_every_place_that_counts_exits(run, tmp_path):
    words = words_of(write(run, tmp_path))
    assert "Where cars left the road in training Once, a cross each." in words
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
    text = write(run, tmp_path, reports_along(12), small).read_text(encoding="utf-8")
    sent = base64.b64decode(re.search(r'<video[^>]* src="data:video/mp4;base64,([^"]+)"', text)[1])
    with av.open(io.BytesIO(sent)) as film, av.open(str(large)) as whole:
        (stream,) = film.streams.video
        assert (stream.width, stream.height) == (SMALL_WIDTH, SMALL_HEIGHT)
        assert stream.frames == whole.streams.video[0].frames
        assert film.duration == pytest.approx(whole.duration, rel=0.01)


def test_another_track_of_the_same_name_is_not_drawn(run, tmp_path):
    job = run.read_job()
    run.write_job({**job, "track": {**job["track"], "hash": "0" * 12}})
    assert "<img" not in write(run, tmp_path).read_text(encoding="utf-8")

"""The page of benchmarks is made of the figures that stand beside it, and says itself what it does not reach."""

import importlib.util
import json
import re
import sys
import threading
import time
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parents[1] / "benchmarks"
RESULTS = json.loads((HERE / "results.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def run_all():
    sys.path.insert(0, str(HERE))
    try:
        spec = importlib.util.spec_from_file_location("run_all", HERE / "run_all.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        yield module
    finally:
        sys.path.remove(str(HERE))


@pytest.fixture(scope="module")
def rows(run_all):
    return sys.modules["rows"]


def test_the_page_is_made_of_the_figures_beside_it(run_all):
    assert (HERE / "README.md").read_text(encoding="utf-8") == run_all.page(RESULTS)


def test_a_row_that_misses_its_at_least_says_so(rows):
    lines = (HERE / "README.md").read_text(encoding="utf-8").splitlines()
    every = [row for name, make in rows.ROWS.items() if name in RESULTS for row in make(RESULTS[name])]
    with_floor = [row for row in every if rows.meets(row) is not None]
    assert len(with_floor) > 12
    for row in every:
        (line,) = [line for line in lines if line.startswith(f"| {row[0]} |")]
        assert ("**misses**" in line) == (rows.meets(row) is False)


@pytest.mark.parametrize(
    ("measured", "least", "kept"),
    [
        ("15,000 ticks/s", "15k", True), ("14,999 ticks/s", "15k", False), ("1,499,999 game-steps/s", "1.5M", False),
        ("12 s", "12 s", True), ("12.1 s", "12 s", False), ("2,001 MB", "2 GB", False), ("100.1 ms", "100 ms", False),
        ("0 of 34,211", "0", True), ("1 of 34,211", "0", False), ("54.9%", "55%", False), ("1.7×", "1.7×", True),
        ("899 /s", "900 /s", False), ("3 s", "-", None),
    ],
)  # fmt: skip
def test_at_least_is_read_in_its_own_unit(rows, measured, least, kept):
    assert rows.meets(("what", measured, least, "-", "-")) is kept


def test_a_speed_up_is_counted_from_the_best_figure_of_one_core(rows):
    """By hand: 344,839 is more than 265,181, so 568,568 is 1.65 times one core and not 2.14."""
    figures = {"many_two_cores": 568_568, "many_one_core": 265_181, "sight_one_core": 344_839, "rules_one_core": 1}
    figures |= {f"{name}_{end}": 1 for name in ("rules_one_core", "sight_one_core") for end in ("low", "high")}
    (row,) = [row for row in rows.battlesnake_rows(figures) if "over the best of one core" in row[0]]
    assert row[1] == "1.65×"
    assert re.search(r"568,568 over 344,839", row[4])


def test_who_never_solves_a_world_counts_as_endless_beside_the_others():
    """By hand: ours 2, 4, 6 processor seconds (median 4), theirs 6, 10 and never (median 10, 2.5 times as long)."""
    spec = importlib.util.spec_from_file_location("peers", HERE / "peers.py")
    peers = importlib.util.module_from_spec(spec)
    sys.modules["peers"] = peers  # its dataclass looks there for its own module
    spec.loader.exec_module(peers)

    def runs(*seconds):
        return [{"seconds": one, "processor_seconds": one, "steps": 1} for one in seconds]

    found = {"CartPole-v1": {"racecraft": runs(2, 4, 6), "stable-baselines3": runs(6, 10, None)}}
    ours, theirs = peers.table(found).splitlines()[2:]
    assert ours == "| CartPole-v1 | racecraft | 3 of 3 | 4 | 4 | - | 2, 4, 6 |"
    assert theirs == "| CartPole-v1 | stable-baselines3 | 2 of 3 | 10 | 10 | 2.50× | 6, 10, not solved |"
    found["CartPole-v1"]["stable-baselines3"] = runs(6, None, None)
    assert "| inf | inf | inf× |" in peers.table(found)


class _Dreamer(BaseHTTPRequestHandler):
    """A snake server that says who it is and sleeps through every move."""

    def do_GET(self):  # noqa: N802
        self._on_message(b'{"apiversion": "1"}')

    def do_POST(self):  # noqa: N802
        self.rfile.read(int(self.headers["Content-Length"]))
        if self.path == "/move":
            self.server.wakes.wait(60)
        self._on_message(b'{"move": "up"}')

    def _on_message(self, answer):
        with suppress(OSError):  # the other side has hung up
            self.send_response(200)
            self.end_headers()
            self.wfile.write(answer)

    def log_message(self, *_):
        pass


@pytest.mark.parametrize("snakes", [2, 4])
def test_a_match_against_a_server_counts_its_late_answers_and_plays_both_seats(run_all, snakes):
    matches = importlib.import_module("snake_matches")
    with ThreadingHTTPServer(("127.0.0.1", 0), _Dreamer) as server:
        server.wakes = threading.Event()
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        url = f"http://127.0.0.1:{server.server_address[1]}"
        try:
            games = list(matches.games_by_the_clock("hungry", url, 7, snakes, 40, range(2)))
        finally:
            server.wakes.set()
            server.shutdown()
    assert [game["worth"] for game in games] == [1.0, 1.0]  # upwards from either seat is the wall
    for game in games:
        assert game["late"][1] >= 1
        assert game["failed"][0] == 0


def test_a_match_that_was_broken_off_goes_on_with_the_next_dice(run_all, tmp_path, monkeypatch, capsys):
    matches = importlib.import_module("snake_matches")
    played, kept = [], tmp_path / "games.jsonl"

    def games(first, second, size, snakes, milliseconds, which, think, lost):
        for game in which:
            played.append(game)
            yield {"worth": 1.0, "turns": 10 + game, "late": [0, game], "failed": [0, 0]}
            if len(played) == 3:
                raise KeyboardInterrupt

    monkeypatch.setattr(matches, "games_by_the_clock", games)
    command = ["snake_matches.py", "hungry", "http://localhost:1", "--keep", str(kept), "--games"]
    monkeypatch.setattr(sys, "argv", [*command, "6"])
    with pytest.raises(KeyboardInterrupt):
        matches.main()
    matches.main()
    assert played == [0, 1, 2, 3, 4, 5]
    told = json.loads(capsys.readouterr().out)
    assert (told["games"], told["won"], told["late_second"], told["mean_turns"]) == (6, 6, 15, 12)
    monkeypatch.setattr(sys, "argv", [*command, "6", "--snakes", "4"])
    with pytest.raises(SystemExit, match="keeps another match"):
        matches.main()
    kept.write_text('{"first": "hun', encoding="utf-8")
    with pytest.raises(SystemExit, match="no file of a match"):
        matches.main()


@pytest.fixture
def slow_server():
    """A snake that moves upwards after 30 ms, whatever the timeout."""

    class Slow(_Dreamer):
        def do_POST(self):  # noqa: N802
            time.sleep(0.03 * (self.path == "/move"))
            super().do_POST()

    with ThreadingHTTPServer(("127.0.0.1", 0), Slow) as server:
        server.wakes = threading.Event()
        server.wakes.set()
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}"
        finally:
            server.shutdown()


def test_by_the_processor_a_late_answer_is_waited_for_and_still_counted(run_all, slow_server, tmp_path, monkeypatch):
    """Upwards from the start is the wall after some turns: each answer of the server comes 30 ms late, none is lost."""
    matches = importlib.import_module("snake_matches")
    from racecraft.worlds.battlesnake.players import alpha_beta_search, search

    asked = []
    choose = search.Search.choose
    monkeypatch.setattr(
        search.Search, "choose", lambda self, *question: asked.append(question[3]) or choose(self, *question)
    )
    monkeypatch.setattr("torch.set_num_threads", lambda count: None)
    monkeypatch.setattr(alpha_beta_search, "time", alpha_beta_search.time)
    monkeypatch.setattr(search, "time", search.time)
    (game,) = matches.games_by_the_clock("search", slow_server, 7, 2, 10, range(1), 4.0, tmp_path)
    assert search.time.monotonic is time.thread_time
    assert set(asked) == {0.0, 0.004}  # 0 before the game, to have everything compiled
    assert game["worth"] == 1.0
    assert game["late"][1] == game["turns"] > 1
    assert game["failed"] == [0, 0]
    assert 30 <= game["mean_ms"][1] <= game["most_ms"][1]
    assert list(tmp_path.iterdir()) == []


def test_a_game_that_was_not_won_is_kept_to_be_studied(run_all, slow_server, tmp_path):
    from racecraft.worlds.battlesnake.evaluation.record import read_record

    matches = importlib.import_module("snake_matches")
    (game,) = matches.games_by_the_clock(slow_server, "hungry", 7, 2, 500, range(1), None, tmp_path)
    assert game["worth"] == 0.0
    assert read_record(tmp_path / "game-1.jsonl").turns == game["turns"]


def test_the_table_of_public_snakes_is_made_of_the_games_beside_it(run_all):
    opponents = importlib.import_module("snake_opponents")
    page = opponents.PAGE.read_text(encoding="utf-8")
    matches = json.loads(opponents.FIGURES.read_text(encoding="utf-8"))["matches"]
    assert opponents.page(page, matches) == page
    assert matches
    for match in matches:
        assert len({len(match[what]) for what in ("worth", "turns", "late", "failed")}) == 1


def test_games_that_were_kept_become_a_line_of_the_table(run_all, tmp_path):
    """By hand: 2.5 of 4 games are 62.5 %, and Wilson's interval of that is 21.9 to 90.9 %."""
    opponents = importlib.import_module("snake_opponents")
    lines = [{"first": "search", "second": "http://localhost:1", "size": 11, "snakes": 2, "milliseconds": 500.0}]
    for worth, turns, late in ((1.0, 100, [0, 1]), (1.0, 200, [0, 0]), (0.5, 301, [2, 0]), (0.0, 1, [0, 0])):
        lines.append({"worth": worth, "turns": turns, "late": late, "failed": [0, 3]})
    (tmp_path / "worm.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    (match,) = json.loads(opponents.told_by(opponents.gathered(tmp_path)))["matches"]
    assert match["against"] == "worm"
    assert opponents.row(match) == "| worm | 2 | 4 | 2 | 1 | 1 | 62 % (22 – 91 %) | 150 | 2, 1 | 0, 12 |\n"


def test_games_of_one_player_leave_those_of_others(run_all):
    opponents = importlib.import_module("snake_opponents")
    game = {"worth": [1.0], "turns": [9], "late": [[0, 0]], "failed": [[0, 0]], "snakes": 2}
    old, other, new = (
        {"first": first, "against": against, **game} for first, against in (("a", "x"), ("b", "x"), ("a", "y"))
    )
    known = opponents.in_the_place_of([old, other], [new])
    assert known == [other, new]
    marks = [opponents.BEGIN.format(first) + opponents.END for first in "ab"]
    text = opponents.page(f"1\n{marks[0]}2\n{marks[1]}3\n", known)
    of_a, of_b = text.split("2\n")
    assert "| y |" in of_a
    assert "| x |" not in of_a
    assert "| x |" in of_b
    assert opponents.page(text, known) == text, "a table takes the place of the one before"


def test_games_of_the_table_can_be_laid_back_and_gone_on_with(run_all, tmp_path):
    opponents = importlib.import_module("snake_opponents")
    matches = json.loads(opponents.FIGURES.read_text(encoding="utf-8"))["matches"]
    matches = [match for match in matches if match["first"] == "search"]
    opponents.lay_back(matches, tmp_path)
    assert opponents.gathered(tmp_path) == matches
    keeper = importlib.import_module("snake_matches").Keeper
    one = matches[0]
    match = {what: one[what] for what in ("first", "second", "size", "snakes", "milliseconds", "think")}
    assert [game["turns"] for game in keeper(tmp_path / f"{one['against']}.jsonl", match).games] == one["turns"]

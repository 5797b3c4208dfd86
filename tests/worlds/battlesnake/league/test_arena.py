"""An arena that lasts: what its file promises, who is drawn to meet, the anchors' scale, players that change or go."""

import sqlite3
import threading
from contextlib import closing
from itertools import islice

import numpy as np
import pytest

from racecraft.evaluation.rating import Result, rate, strengths, wins_of
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.league.pairing import gains, next_group
from racecraft.web.server import ServerThread
from racecraft.worlds.battlesnake.evaluation.game_files import verify_file
from racecraft.worlds.battlesnake.league import arena as arena_at_play
from racecraft.worlds.battlesnake.league.arena import Arena
from racecraft.worlds.battlesnake.league.entry import entrant_of, fingerprint, pinned
from racecraft.worlds.battlesnake.league.ladder import Ladder
from racecraft.worlds.battlesnake.league.store import ArenaStore
from racecraft.worlds.battlesnake.league.terms import ArenaError, ArenaGame, ArenaTerms, Entrant
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.players.protocol import PlayerError
from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer

SMALL = ArenaTerms(7, 7, snakes=(2,), timeout_ms=200, most_turns=60)
UP = "def move(data):\n    return 'up'\n"


def arena_of(path, *names, terms=SMALL):
    """Return a store with these built-in players, the first of them its anchor."""
    store = ArenaStore.begin(path / "arena.sqlite", terms)
    for number, name in enumerate(names):
        store.add(entrant_of(name, anchor=number == 0))
    return store


def play(store, games, said=None):
    """Play so many games; return them."""
    with closing(Arena(store, on_message=(said if said is not None else []).append).play()) as held:
        return [game for game, _ in islice(held, games)]


def game_of(players, places, number=1):
    nothing = (0,) * len(players)
    return ArenaGame(number, players, places, 10, nothing, nothing)


def test_every_game_is_kept_and_can_be_replayed(tmp_path):
    store = arena_of(tmp_path, "flood_fill", "random_safe")
    played = play(store, 4)
    assert ArenaStore(store.path).games() == played
    assert [game.meeting for game in played] == [1, 1, 2, 2]
    assert played[0].players == played[1].players[::-1], "seats are swapped"
    out = tmp_path / "game.jsonl"
    out.write_text(store.record(1))
    report = verify_file(out)
    assert report.agrees
    assert report.steps == played[0].turns


def test_a_meeting_that_was_broken_off_goes_on(tmp_path):
    store = arena_of(tmp_path, "flood_fill", "random_safe")
    first = play(store, 1)[0]
    second = play(ArenaStore(store.path), 1)[0]
    assert (second.number, second.meeting, second.rotation) == (2, first.meeting, 1)
    assert second.players == first.players[::-1]


def test_a_killed_game_leaves_nothing_behind(tmp_path, monkeypatch):
    store = arena_of(tmp_path, "flood_fill", "random_safe")
    play(store, 1)

    def killed(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(arena_at_play, "record_text", killed)
    with pytest.raises(KeyboardInterrupt):
        play(store, 1)
    assert len(store.games()) == 1
    monkeypatch.undo()
    assert play(store, 1)[0].number == 2, "and the arena is free again"


def test_a_game_is_kept_whole_or_not_at_all(tmp_path):
    store = arena_of(tmp_path, "flood_fill", "random_safe")
    meeting = store.draw((0, 1))
    bad = ArenaGame(0, (0, 1), (0, None), 3, (0, 0), (0, 0), meeting.number, 0, 1.0)
    with pytest.raises(ArenaError, match="the database refuses"):
        store.keep(bad, "{}\n")
    assert store.games() == []
    with closing(sqlite3.connect(store.path)) as database:
        assert database.execute("select count(*) from games").fetchone() == (0,)


def test_two_never_play_in_one_arena(tmp_path):
    store = arena_of(tmp_path, "flood_fill", "random_safe")
    with closing(Arena(store).play()) as held:
        next(held)
        assert store.is_playing
        with pytest.raises(ArenaError, match="somebody plays in it already"):
            play(ArenaStore(store.path), 1)
        store.add(entrant_of("hungry"))
    assert not store.is_playing
    assert len(store.entrants()) == 3


def test_players_come_and_go_while_it_plays(tmp_path):
    store = arena_of(tmp_path, "random_safe", "hungry")
    with closing(Arena(store).play()) as held:
        next(held), next(held)
        newcomer = store.add(entrant_of("flood_fill"))
        assert newcomer.number in next(held)[0].players, "least is known of who has just come"
        next(held)
        store.set_rest(newcomer, True)
        assert all(newcomer.number not in next(held)[0].players for _ in range(4))


def test_numbers_stay_apart_when_many_come_at_once(tmp_path):
    store = arena_of(tmp_path, "flood_fill")
    threads = [threading.Thread(target=store.add, args=[Entrant(0, f"p{n}", "hungry")]) for n in range(12)]
    for one in threads:
        one.start()
    for one in threads:
        one.join(60)
    assert [one.number for one in store.entrants()] == list(range(13))


def test_fours_are_drawn_as_often_as_duels(tmp_path):
    terms = ArenaTerms(7, 7, snakes=(2, 4), timeout_ms=200, most_turns=5)
    store = arena_of(tmp_path, "flood_fill", "hungry", "random_safe", "area_control", terms=terms)
    sizes = [len(game.players) for game in play(store, 12)]
    assert sizes == [2, 2, 4, 4, 4, 4, 2, 2, 2, 2, 4, 4]
    four = [game for game in store.games() if len(game.players) == 4][:4]
    assert {game.players[0] for game in four} == {0, 1, 2, 3}, "everybody sits everywhere"


def test_too_few_players_are_named(tmp_path):
    with pytest.raises(ArenaError, match="1 of 1 players can play, and 2 sit at a board"):
        play(arena_of(tmp_path, "flood_fill"), 1)


def test_the_anchors_hold_the_scale():
    """However many strong players come, the anchors' mean stays where it was."""
    games = [Result((0, 1), (0, 1))] * 10 + [Result((0, 1), (1, 0))] * 5
    before = rate(2, games, anchors=(0, 1))
    strong = games + [Result((other, one), (0, 1)) for other in (2, 3, 4) for one in (0, 1)] * 10
    after = rate(5, strong, anchors=(0, 1))
    assert np.mean([one.points for one in after[:2]]) == pytest.approx(1500)
    assert np.mean([one.points for one in before]) == pytest.approx(1500)
    assert after[0].points - after[1].points == pytest.approx(before[0].points - before[1].points, abs=15)
    assert rate(5, strong)[0].points < 1450, "without anchors they would have been pushed down"
    alone = rate(2, games, anchors=(1,))
    assert (alone[1].points, alone[1].low, alone[1].high) == pytest.approx((1500, 1500, 1500))


def test_the_least_known_and_least_sure_pair_comes_first():
    games = [Result((0, 1), (0, 1))] * 30 + [Result((0, 1), (1, 0))] * 30 + [Result((0, 2), (0, 1))] * 2
    found, covariance = strengths(wins_of(4, games))
    gain = gains(found, covariance)
    assert (np.diag(gain) == 0).all()
    assert np.allclose(gain, gain.T)
    met = np.zeros((4, 4))
    assert 3 in next_group(found, covariance, met, range(4), 2), "nobody knows 3"
    assert next_group(found, covariance, met, (0, 1, 2), 2) != [0, 1], "that one is known"
    assert sorted(next_group(found, covariance, met, range(4), 4)) == [0, 1, 2, 3]
    equal, unsure = strengths(wins_of(4, []))
    met[0, 1] = met[1, 0] = 1
    assert next_group(equal, unsure, met, range(4), 2) == [0, 2], "among equals those who met least"


def test_a_ladder_counts_what_it_hears_apart_and_together():
    ladder = Ladder((2, 4))
    ladder.count([game_of((0, 1), (0, 1), 1), game_of((1, 0), (0, 0), 2), game_of((3, 2, 1, 0), (0, 1, 2, 2), 3)])
    entrants = [Entrant(number, name, "hungry", is_anchor=number == 0) for number, name in enumerate("abcd")]
    assert [ladder.games(size) for size in (0, 2, 4)] == [3, 2, 1]
    assert str(ladder.score(entrants, 0, 1)) == "1-2-0"
    assert str(ladder.score(entrants, 1, 0, 2)) == "0-1-1"
    assert {line.name for line in ladder.rungs(entrants, 2)} == {"a", "b"}
    best = ladder.rungs(entrants, 4)[0]
    assert (best.name, best.games, best.wins) == ("d", 1, 1)
    assert ladder.met(entrants, 4)[0, 3] == 1
    anchor = next(line for line in ladder.rungs(entrants) if line.name == "a")
    assert anchor.rating.points == pytest.approx(1500), "the only anchor is the scale"


def test_a_file_that_changes_is_another_player(tmp_path):
    store = arena_of(tmp_path, "flood_fill", "random_safe")
    file = tmp_path / "mine.py"
    file.write_text(UP)
    mine = store.add(entrant_of(str(file), "mine"))
    assert mine.source == str(file)
    play(store, 2)
    file.write_text(UP + "\n")
    said = []
    games = play(store, 2, said)
    assert all(mine.number not in game.players for game in games)
    assert len(said) == 1
    assert "mine is left out" in said[0]
    assert "has changed since it came in" in said[0]
    file.write_text(UP)
    assert any(mine.number in game.players for game in play(store, 6))


def serve():
    thread = ServerThread(SnakeServer(find_player("flood_fill")).application, "snake")
    return thread.start("127.0.0.1", 0), thread.close


def test_a_server_that_went_away_loses_no_game_by_it(tmp_path, monkeypatch):
    monkeypatch.setattr(arena_at_play, "FIRST_PAUSE_SECONDS", 0.2)
    port, stop = serve()
    store = arena_of(tmp_path, "hungry", "random_safe")
    remote = store.add(entrant_of(f"http://127.0.0.1:{port}", "far"))
    assert any(remote.number in game.players for game in play(store, 4))
    stop()
    said = []
    games = play(store, 2, said)
    assert all(remote.number not in game.players for game in games)
    assert said
    assert said[0].startswith("far sits out for")


def test_a_game_during_which_a_server_went_away_does_not_count(tmp_path, monkeypatch):
    port, stop = serve()
    store = arena_of(tmp_path, "hungry", "random_safe")
    far = store.add(entrant_of(f"http://127.0.0.1:{port}", "far"))
    real, stopped = arena_at_play.play, []

    def gone(settings, seats, *rest, **more):
        if not stopped and any(seat.name == "far" for seat in seats):
            stop()
            stopped.append(True)
        return real(settings, seats, *rest, **more)

    monkeypatch.setattr(arena_at_play, "play", gone)
    said = []
    games = play(store, 4, said)
    assert stopped
    assert all(far.number not in game.players for game in games)
    assert "its server went away; the game does not count" in said[0]


@pytest.mark.parametrize(("sizes", "numbers"), [((), {}), ((2, 2), {}), ((1,), {}), ((2,), {"timeout_ms": 0})])
def test_terms_that_nobody_can_play_are_refused(sizes, numbers):
    with pytest.raises(ArenaError, match="expected"):
        ArenaTerms(snakes=sizes, **numbers)


def test_what_is_no_arena_is_named(tmp_path):
    with pytest.raises(ArenaError, match="there is no arena"):
        ArenaStore(tmp_path / "none.sqlite")
    other = tmp_path / "other.sqlite"
    with closing(sqlite3.connect(other)) as database:
        database.execute("create table songs (name text)")
        database.commit()
    with pytest.raises(ArenaError, match="another program's database"):
        ArenaStore(other)
    text = tmp_path / "notes.txt"
    text.write_text("not a database at all, but long enough to look at" * 40)
    with pytest.raises(ArenaError, match="no arena"):
        ArenaStore(text)
    store = arena_of(tmp_path, "flood_fill")
    with pytest.raises(ArenaError, match="something stands there"):
        ArenaStore.begin(store.path, SMALL)
    with pytest.raises(ArenaError, match="none was played yet"):
        store.record(3)
    with pytest.raises(ArenaError, match="flood_fill"):
        store.find("floodfill")
    with closing(sqlite3.connect(store.path)) as database:
        database.execute("pragma user_version = 9")
    with pytest.raises(ArenaError, match="version 9; expected 1"):
        ArenaStore(store.path)


def test_only_what_never_changes_holds_the_scale(tmp_path):
    for changing in ("search", "search+flood_fill", "http://localhost:1"):
        with pytest.raises(ArenaError, match="expected an anchor that never does"):
            entrant_of(changing, anchor=True)
    with pytest.raises(PlayerError, match="no player 'floodfill'"):
        entrant_of("floodfill", anchor=True)
    assert entrant_of("hungry", anchor=True).is_anchor


def test_a_run_is_pinned_to_the_checkpoint_it_has_now(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = RunFolder.create("runs/one", {"kind": "battlesnake"})
    shelf = Checkpoints(run.checkpoints)
    shelf.save(7, 100, {"a": np.zeros(3, np.float32)}, {})
    source = pinned("search+runs/one")
    assert source == f"search+{tmp_path}/runs/one:7"
    before = fingerprint(source)
    shelf.save(8, 200, {"a": np.ones(3, np.float32)}, {}, best=True)
    assert fingerprint(source) == before, "what is trained on is another player"
    assert pinned("runs/one") == f"{tmp_path}/runs/one:8"
    assert fingerprint(pinned("runs/one")) != before
    assert pinned("flood_fill") == "flood_fill"
    assert fingerprint("flood_fill") == ""

"""A snake's run is judged against the anchors, by hand."""

from types import SimpleNamespace

import pytest

from racecraft.evaluation.evaluate_run import evaluate_run
from racecraft.evaluation.rating import Result, wilson
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.battlesnake.evaluation import judged_run
from racecraft.worlds.battlesnake.players.anchors import ANCHORS

POLICY = SimpleNamespace(checkpoint=SimpleNamespace(iteration=12), metadata={"settings": "its settings"})


@pytest.mark.parametrize(("words", "games", "seed"), [({}, 50, 1_000_000_007), ({"episodes": 4, "seed": 3}, 4, 3)])
def test_a_snake_is_judged_against_every_anchor_and_shared_first_places_are_no_wins(
    tmp_path, monkeypatch, words, games, seed
):
    run = RunFolder.create(tmp_path / "run", {"kind": "battlesnake", "asked": {"game": {"players": 3}}})
    asked = []
    places = [(0, 1, 2), (0, 0, 2), (1, 0, 2), (0, 1, 1)]

    def play(players, settings, count, seed):
        asked.append((players, settings.game.players, settings.view, settings.outlook, count, seed))
        return [Result((0, 1, 2), one) for one in places]

    monkeypatch.setattr(judged_run, "load_policy", lambda run, which: POLICY)
    monkeypatch.setattr(judged_run, "snake_config_in", lambda settings: SimpleNamespace(view=7, outlook=True))
    monkeypatch.setattr(judged_run, "play_batch", play)
    told = evaluate_run(run.path, **words)
    assert asked == [([POLICY, name, name], 3, 7, True, games, seed) for name in ANCHORS]
    low, high = wilson(2, 4)
    figures = {"games": 4, "won": 2, "won_share": 0.5, "won_share_low": low, "won_share_high": high}
    assert told == {"run": str(run.path), "checkpoint": 12, "against": dict.fromkeys(ANCHORS, figures)}

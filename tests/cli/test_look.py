"""`racecraft look`: the whole way, over a run that learned nothing."""

import json

import numpy as np
import pytest


def test_a_lap_and_pictures(racecraft, run, tmp_path):
    from PIL import Image

    said = racecraft("look", "r", "--json", "--page", "page.html")
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert (run / "look.mp4").stat().st_size > 1000
    assert "What it looks at" in (tmp_path / "page.html").read_text()
    assert sum(row["attention_share"] for row in told["surfaces"]) == pytest.approx(1.0, abs=0.01)
    assert told["findings"]

    Image.fromarray(np.full((12, 16, 3), 90, np.uint8)).save(tmp_path / "one.png")
    told = json.loads(racecraft("look", "r", "one.png", "--film", "one.mp4", "--json").out)
    assert len(told["pictures"]) == 1
    assert 0.0 < told["pictures"][0]["second_share"] <= told["pictures"][0]["chosen_share"] <= 1.0
    through = json.loads(racecraft("look", "r", "r/look.mp4", "--film", "again.mp4", "--json").out)
    assert len(through["pictures"]) > 10

    assert "belong to a lap" in racecraft("look", "r", "one.png", "--track", "Oval_track").err
    assert racecraft("look", "r", "nothing.png").code == 2
    assert "expected 0 to" in racecraft("look", "r", "--option", "99").err

"""A run of a scene is judged by whole episodes of that scene, by hand."""

import json
import os

from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.unity import evaluation


def test_patience_is_what_the_latest_evaluation_that_tells_it_had(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "unity"})
    assert evaluation._patience_of(run) is None
    for age, (name, text) in enumerate({
        "newest": "no json", "newer": "[3]", "none": '{"most_steps": 0}', "words": '{"most_steps": "9"}',
        "this": json.dumps({"most_steps": 1}), "older": '{"most_steps": 70}',
    }.items()):  # fmt: skip
        (run.evaluations / f"{name}.json").write_text(text)
        os.utime(run.evaluations / f"{name}.json", (1000 - age, 1000 - age))
    assert evaluation._patience_of(run) == 1
    (run.evaluations / "this.json").unlink()
    assert evaluation._patience_of(run) == 70

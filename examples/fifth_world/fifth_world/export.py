"""`racecraft export RUN --to table`: what the walker does in every cell, for programs that know no networks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from racecraft.export.exported import Exported
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.players.trained import load_policy


def export_table(run: Path, to: str, which: str | None, output: Path | None, check: bool) -> Exported:
    """Write a JSON list of "left" and "right", a cell each."""
    policy = load_policy(run, which or "best")
    length = policy.run.read_job()["asked"]["length"]
    places = np.linspace(0.0, 1.0, length, dtype=np.float32)[:, None]
    steps = [policy.spec.actions.labels[choice] for choice in policy.act({"place": places})]
    path = output or policy.run.path / "export" / "table.json"
    make_folder(path.parent)
    write_atomic(path, json.dumps(steps) + "\n")
    return Exported({"file": str(path)}, (f"{path}: {length} cells",))

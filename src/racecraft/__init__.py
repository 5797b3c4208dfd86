"""racecraft: train, watch, judge, explain, race and ship reinforcement-learning agents on your own machine.

The public face, `import racecraft as rc`; everything is imported when it is first asked for::

    rc.train("gymnasium", environment="CartPole-v1")     train, in any kind of world
    rc.resume("runs/CartPole-v1-1")                      go on with a run
    rc.evaluate("runs/reinvent_base-1")                  judge what was trained
    rc.load_policy("runs/reinvent_base-1")               a policy by itself: no world, no settings
    rc.tune("gym train …", {…}, "tunings/1")             look for settings; rc.train_population likewise
    rc.record("runs/CartPole-v1-1", episodes=3)          demonstrations; rc.checkpoints, rc.report, rc.export_run,
                                                         rc.compare, rc.stop likewise: the options of the command
    rc.make_world("deepracer", track="Oval_track")       a world to step by hand
    rc.enter_race("club-evening", "runs/oval-1")         races: rc.create_race, rc.list_races, rc.show_race,
                                                         rc.edit_race, rc.copy_race, rc.open_race, rc.judge_race,
                                                         rc.close_race, rc.reset_race, rc.withdraw_entry,
                                                         rc.show_board, rc.show_racer, rc.show_records,
                                                         rc.show_standings, rc.create_season, rc.audit_races,
                                                         rc.export_league, rc.film_race_drive, rc.show_on_screen
    rc.read_run("runs/reinvent_base-1")                  what a run left, as tables
    rc.register_algorithm("mine", MyLearner)             an algorithm of your own

A world adds names of its own (`WorldKind.names`), DeepRacer these::

    rc.logs.read("old-logs/")                            any DeepRacer log as one table
    rc.load_track("Oval_track")                          a track of the catalogue
    rc.line("Oval_track", out="line.csv")                commands by name: rc.why, rc.look, rc.race, rc.replay,
                                                         rc.sensors, rc.action_table, rc.import_model …
"""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Threads that wait for each other spin briefly and then sleep: beside other busy programs long spinning costs ten
# times what it saves. OpenMP reads this when PyTorch and Numba load it.
os.environ.setdefault("GOMP_SPINCOUNT", "2000")

if TYPE_CHECKING:
    from racecraft.actions.checkpoints import checkpoints
    from racecraft.actions.compare import compare
    from racecraft.actions.export import export_run
    from racecraft.actions.judging import evaluate
    from racecraft.actions.league.boards import list_races, show_board, show_race
    from racecraft.actions.league.entries import enter_race, withdraw_entry
    from racecraft.actions.league.exporting import export_league
    from racecraft.actions.league.filming import film_race_drive
    from racecraft.actions.league.judging import audit_races, judge_race
    from racecraft.actions.league.managing import (
        close_race,
        copy_race,
        edit_race,
        open_race,
        reset_race,
        show_on_screen,
    )
    from racecraft.actions.league.seasons import create_season, show_racer, show_records, show_standings
    from racecraft.actions.record import record
    from racecraft.actions.report import report
    from racecraft.actions.runs import load_policy, read_run
    from racecraft.actions.stop import stop
    from racecraft.actions.training import resume, train
    from racecraft.actions.tuning import train_population, tune
    from racecraft.actions.worlds import make_world
    from racecraft.algorithms.registry import register_algorithm

_WHERE = {
    "checkpoints": "racecraft.actions.checkpoints",
    "compare": "racecraft.actions.compare",
    "export_run": "racecraft.actions.export",
    "record": "racecraft.actions.record",
    "report": "racecraft.actions.report",
    "stop": "racecraft.actions.stop",
    "train": "racecraft.actions.training",
    "resume": "racecraft.actions.training",
    "evaluate": "racecraft.actions.judging",
    "load_policy": "racecraft.actions.runs",
    "tune": "racecraft.actions.tuning",
    "train_population": "racecraft.actions.tuning",
    "make_world": "racecraft.actions.worlds",
    "read_run": "racecraft.actions.runs",
    "list_races": "racecraft.actions.league.boards",
    "show_board": "racecraft.actions.league.boards",
    "show_race": "racecraft.actions.league.boards",
    "enter_race": "racecraft.actions.league.entries",
    "withdraw_entry": "racecraft.actions.league.entries",
    "audit_races": "racecraft.actions.league.judging",
    "film_race_drive": "racecraft.actions.league.filming",
    "judge_race": "racecraft.actions.league.judging",
    "close_race": "racecraft.actions.league.managing",
    "show_on_screen": "racecraft.actions.league.managing",
    "copy_race": "racecraft.actions.league.managing",
    "edit_race": "racecraft.actions.league.managing",
    "open_race": "racecraft.actions.league.managing",
    "reset_race": "racecraft.actions.league.managing",
    "export_league": "racecraft.actions.league.exporting",
    "create_season": "racecraft.actions.league.seasons",
    "show_racer": "racecraft.actions.league.seasons",
    "show_records": "racecraft.actions.league.seasons",
    "show_standings": "racecraft.actions.league.seasons",
    "register_algorithm": "racecraft.algorithms.registry",
}

__all__ = [
    "__version__",
    "audit_races",
    "checkpoints",
    "close_race",
    "compare",
    "copy_race",
    "create_season",
    "edit_race",
    "enter_race",
    "evaluate",
    "export_league",
    "export_run",
    "film_race_drive",
    "judge_race",
    "list_races",
    "load_policy",
    "make_world",
    "open_race",
    "read_run",
    "record",
    "register_algorithm",
    "report",
    "reset_race",
    "resume",
    "show_board",
    "show_on_screen",
    "show_race",
    "show_racer",
    "show_records",
    "show_standings",
    "stop",
    "train",
    "train_population",
    "tune",
    "withdraw_entry",
]


def __getattr__(name: str) -> Any:
    if name in _WHERE:
        return getattr(importlib.import_module(_WHERE[name]), name)
    targets = {} if name.startswith("_") else _names_of_worlds()
    if name not in targets:
        raise AttributeError(f"module 'racecraft' has no attribute {name!r}")
    from racecraft.contract.kind import load

    return load(targets[name])


def _names_of_worlds() -> dict[str, str]:
    """Return what each name that an installed world adds stands for, such as `rc.logs`."""
    from racecraft.contract.kinds import kinds

    return {name: target for kind in kinds() for name, target in kind.names.items()}


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_names_of_worlds()})

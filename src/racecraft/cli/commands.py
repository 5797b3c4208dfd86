"""Every command that is installed, in one table; nothing is imported for it. Begin with `commands`.

What belongs to no world stands here; a world's commands stand in its `WorldKind`.
"""

from __future__ import annotations

from racecraft.contract.kind import EXCHANGE, JUDGE, PANELS, TRAIN, UNDERSTAND, WORKSHOP, Command
from racecraft.contract.kinds import kinds

GENERAL = (
    Command("stop", "racecraft.cli.runs.stop:stop", TRAIN),
    Command("tune", "racecraft.cli.jobs.tune:tune", TRAIN),
    Command("algorithms", "racecraft.cli.algorithms:algorithms", TRAIN),
    Command("settings", "racecraft.cli.settings:settings", TRAIN),
    Command("console", "racecraft.cli.console:console", TRAIN),
    Command("workspace", "racecraft.cli.workspace:app", EXCHANGE),
    Command("lessons", "racecraft.cli.lessons:lessons", UNDERSTAND),
    Command("league", "racecraft.cli.league:app", JUDGE),
    Command("watch", "racecraft.cli.runs.watch:watch", JUDGE),
    Command("checkpoints", "racecraft.cli.runs.checkpoints:checkpoints", JUDGE),
    Command("compare", "racecraft.cli.runs.compare:compare", JUDGE),
    Command("report", "racecraft.cli.runs.report:report", UNDERSTAND),
    Command("export", "racecraft.cli.runs.export:export", EXCHANGE),
    Command("serve", "racecraft.cli.runs.serve:serve", EXCHANGE),
    Command("record", "racecraft.cli.runs.record:record", EXCHANGE),
    Command("bucket", "racecraft.cli.buckets.buckets:app", EXCHANGE),
    Command("jobs", "racecraft.cli.jobs.jobs:app", WORKSHOP),
    Command("people", "racecraft.cli.people.people:app", WORKSHOP),
    Command("run", "racecraft.cli.run:run", WORKSHOP),
    Command("sandbox", "racecraft.cli.jobs.sandbox:sandbox", WORKSHOP),
    Command("schema", "racecraft.cli.schema:schema", WORKSHOP),
)
"""Commands of no world."""
IN_SHORT = (Command("evaluate", "racecraft.cli.runs.judge:evaluate", JUDGE),)
"""Commands of no world in whose place a world may bring one that knows more of its runs."""


def commands() -> list[Command]:
    """Return every command that is installed, in the order of `racecraft --help`; within a panel worlds come first."""
    of_worlds = [command for kind in kinds() for command in kind.commands]
    names = {command.name for command in of_worlds}
    found = [*of_worlds, *(command for command in IN_SHORT if command.name not in names), *GENERAL]
    return sorted(found, key=lambda command: PANELS.index(command.panel))


def command_named(name: str) -> Command | None:
    """Return a command by its name, None where there is none; no world is looked for where it belongs to none."""
    general = next((one for one in GENERAL if one.name == name), None)
    return general or next((one for one in commands() if one.name == name), None)

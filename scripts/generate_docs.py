"""Write the reference pages of the documentation from the code they describe. Begin with `PAGES`.

python scripts/generate_docs.py           writes docs/reference/*.md, docs/packages/*.md and docs/pictures/tracks/*.svg
python scripts/generate_docs.py --check   writes nothing; says which pages are stale and exits with 1

A page is written only when its text changed. Nothing here states a fact: every table comes from the one place where the
program itself reads it.
"""

from __future__ import annotations

import ast
import inspect
import json
import sys
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

DOCS = Path(__file__).resolve().parents[1] / "docs"
CARD_LABEL = 17
"""Letters that the label of a card's line takes, blanks in."""
NOTE = "<!-- Written by scripts/generate_docs.py; edit the code it comes from. -->"


def main(arguments: list[str]) -> int:
    """Write the pages, or with --check say which are stale; return the exit status."""
    if set(arguments) - {"--check"}:
        print("usage: generate_docs.py [--check]", file=sys.stderr)
        return 2
    texts = pages()
    stale = [place for place, text in texts.items() if not _is_current(DOCS / place, text)]
    if "--check" in arguments:
        for place in stale:
            print(f"docs/{place} is stale; `make docs` writes it anew.", file=sys.stderr)
        return 1 if stale else 0
    for place in stale:
        (DOCS / place).parent.mkdir(parents=True, exist_ok=True)
        (DOCS / place).write_text(texts[place], encoding="utf-8", newline="\n")
        print(f"wrote docs/{place}")
    return 0


def pages() -> dict[str, str]:
    """Return every generated file: place under docs/ → text."""
    texts = {place: f"{NOTE}\n\n{write().strip()}\n" for place, write in PAGES.items()}
    return texts | package_pages() | {"reference/schema.json": schema_text()} | track_pictures()


def schema_text() -> str:
    """Return the JSON Schema of every command."""
    from racecraft.cli.app import app
    from racecraft.cli.schema import DIALECT, ERROR, schemas

    schema = {"$schema": DIALECT, "commands": schemas(app), "error": ERROR}
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def settings_page() -> str:
    """Return the table of settings."""
    from racecraft.algorithms.registry import ALGORITHMS
    from racecraft.contract.kinds import kind_names
    from racecraft.settings.describe import settings_markdown
    from racecraft.training.worlds import training_in

    composed = {
        (world, name): training_in(world).default_settings(algorithm)
        for world in kind_names()
        for name, algorithm in ALGORITHMS.items()
    }

    return f"""# Settings

Every setting has one name, `group.name`, and one default. `racecraft settings` prints this table; `--set` changes one:

    racecraft train --set ppo.learning_rate=1e-4 --set rollout.horizon=128

Tuples are written with commas (`16,32`), booleans as `true` or `false`, nothing as `none`. An unknown name is refused
with the nearest known one, and so is a group that has no say in the training: a snake has no `race`. `racecraft
settings --world WORLD --algorithm NAME` lists those of one kind of training; every run's `job.json` holds its own.

{settings_markdown(composed)}"""


def command_page() -> str:
    """Return every command with its arguments and options."""
    from racecraft.cli.app import app

    head = """# Commands

`racecraft COMMAND --help` says the same at the prompt. Every command that prints results takes `--json`: exactly one
JSON object on one line of standard output, everything else on standard error. Where it fails that object is
`{"error": {"kind", "message", "template", "fields"}}`. The schema of all commands: [schema.json](schema.json), or
`racecraft schema COMMAND`. From Python the same options are keywords: `rc.record("runs/CartPole-v1-1", episodes=3)`.

| exit code | meaning |
|---|---|
| 0 | done |
| 1 | something of ours failed: a broken promise between rooms, a training that diverged |
| 2 | what was given cannot be used; the message on standard error says what was found, what is expected, what to do |
| 130 | stopped by Ctrl-C before there was anything to save |
| 141 | the program that read the output has gone |
"""
    return "\n".join([head, *(_command_section(name, function) for name, function in commands(app))])


def reward_page() -> str:
    """Return every key of the dictionary a reward function is given."""
    from racecraft.worlds.deepracer.env.reward_params import REWARD_PARAMETERS

    rows = []
    for key, text in REWARD_PARAMETERS.items():
        kind, _, meaning = text.partition(", " if text.startswith("float, ") and ": " not in text else ": ")
        rows.append((f"`{key}`", kind, meaning))
    return f"""# Reward parameters

The dictionary that `reward_function(params)` is given, once a car and tick, 15 times a simulated second. Keys and
meanings are those of AWS DeepRacer, degrees and per cent included. [The reward function](../racing/reward.md) shows how
to use them.

{_table(("key", "type and unit", "meaning"), rows)}"""


def episode_page() -> str:
    """Return every column of an episode file."""
    from racecraft.formats.episodes import EPISODE_COLUMNS, STATUSES, columns_markdown

    assert EPISODE_COLUMNS
    return f"""# Episode columns

`episodes/N.parquet` in a run folder holds every tick of iteration N, one row a tick, ordered by car and then by time.
Units are SI, angles are radians, a positive angle turns left. Read it by name with any Parquet reader.

{columns_markdown()}

A file of ours may lack the columns that time trials do not need; `status` is one of
{", ".join(f"`{status}`" for status in STATUSES)}."""


def metrics_page() -> str:
    """Return every name in metrics.jsonl."""
    from racecraft.algorithms.asynchronous_ppo import FIGURES as ASYNCHRONOUS
    from racecraft.algorithms.ppo import FIGURES
    from racecraft.algorithms.registry import ALGORITHMS
    from racecraft.analysis.metrics import metrics_markdown

    beside = "\n".join(
        f"| `{figure}` | {meaning} |" for figure, meaning in ASYNCHRONOUS.items() if figure not in FIGURES
    )
    others = "\n\n".join(
        "\n".join(
            [
                f"## With {name}",
                "",
                "| name | meaning |",
                "|---|---|",
                *(f"| `{figure}` | {meaning} |" for figure, meaning in algorithm.learner_class().figures.items()),
            ]
        )
        for name, algorithm in ALGORITHMS.items()
        if name != "ppo"
    )
    return f"""# Metrics

`metrics.jsonl` in a run folder holds one JSON object a line, one line an iteration. What stands between
`best_lap_seconds` and `seconds_collect` is what the learner says of its update: here PPO, below the others.

{metrics_markdown()}

## With `ppo.asynchronous`

| name | meaning |
|---|---|
{beside}

{others}"""


def tracks_page() -> str:
    """Return every circuit of the catalogue."""
    from racecraft.worlds.deepracer.tracks.catalogue import names, summary

    rows = []
    for found in map(summary, names()):
        sizes = (f"{found.length:.2f}", f"{found.width:.2f}", str(found.rows))
        rows.append((f"`{found.name}`", found.title, *sizes, found.direction, ", ".join(found.tags)))
    return f"""# Tracks

{len(rows)} circuits come with racecraft, under the names racers know from AWS. Upper and lower case do not matter, and
the titles are understood too. Length is once round the centre line, width is the mean between the borders. `ccw` runs
counter-clockwise, `cw` clockwise, `open` from a start to a finish.

    racecraft tracks show reinvent_base --picture reinvent.png

A waypoint file of AWS form (`.npy`, K rows of centre, inner and outer x, y in metres) can stand wherever a name can.
`racecraft tracks import FILE.npy --name garage` looks at every row of it and keeps it: `--track garage` finds it from
then on, in whatever folder you are. It is refused with the row where it shows when values are missing, the loop is not
closed, lines cross, the road is too narrow or too wide, or rows are out of order. All of them as pictures:
[Gallery](gallery.md).

{_table(("name", "title", "length (m)", "width (m)", "waypoints", "direction", "tags"), rows)}"""


def best_laps_page() -> str:
    """Return the best known laps of every circuit."""
    from racecraft.worlds.deepracer.driving.known_laps import FORWARD, REVERSE, read_laps
    from racecraft.worlds.deepracer.env.vehicle import MAX_LOGGED_SPEED_MPS
    from racecraft.worlds.deepracer.tracks.catalogue import names, summary

    laps = {lap.key: lap.lap_seconds for lap in read_laps()}
    cars = sorted({(car, speed) for _, _, car, speed in laps}, key=lambda one: (one[0] == "v4", one[1], one[0]))

    def cell(track: str, car: str, speed: float) -> str:
        both = [laps.get((track, direction, car, speed)) for direction in (FORWARD, REVERSE)]
        return " / ".join("–" if seconds is None else f"{seconds:.2f}" for seconds in both)

    rows = [
        (f"`{found.name}`", f"{found.length:.2f}", *(cell(found.name, *one) for one in cars))
        for found in map(summary, names())
    ]
    heads = [
        f"{car} up to {speed:g} m/s" + (" (beyond the logs)" if speed > MAX_LOGGED_SPEED_MPS.get(car, speed) else "")
        for car, speed in cars
    ]
    return f"""# Best known laps

Seconds of a flying lap, forward / reverse: the fastest that was certainly driven in racecraft's world with this car and
the action table it usually has. On an open track it is the drive from rest. "–": not planned, or no reverse direction.
Figures of `v6` above 2.5 m/s rest on inferred limits: no log of that car is faster. How a lap is found, and how to find
one for another table: [The best known lap](../racing/best_lap.md). `scripts/plan_known_laps.py` makes the table again.

{_table(("track", "length (m)", *heads), rows)}"""


def run_env_page() -> str:
    """Return every variable of run.env, and whether it is obeyed."""
    from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME, OTHER_SPELLINGS, VARIABLE_EFFECTS

    def table(status: str) -> str:
        rows = [
            (f"`{one.name}`", one.effect + (f" In a new {one.file}.env: `{one.default}`." if one.default else ""))
            for one in BY_NAME.values()
            if one.status == status
        ]
        return _table(("variable", "what it does here"), rows)

    tables = "\n\n".join(f"## {title}\n\n{table(status)}" for status, title in VARIABLE_EFFECTS.items())
    spellings = [(f"`{other}`", f"`{name}`") for other, name in OTHER_SPELLINGS.items()]
    return f"""# run.env

The variables of DeepRacer for Cloud, as they stand in `run.env`, `system.env` or `worker-N.env` of a [racer's
folder](../racing/your_folder.md#runenv); any file may hold any of them. `racecraft settings FOLDER` prints this table
with the values of one folder. Those that begin with `RACECRAFT_` are ours; DeepRacer for Cloud passes them over.

{tables}

## Other spellings

Documents, older versions and slips of the original's code use these names; they are read and said.

{_table(("written", "read as"), spellings)}"""


def glossary_page() -> str:
    """Return the words of the console, the JSON files and run.env beside ours, and those of the lessons."""
    from racecraft.training.glossary import WORDS
    from racecraft.worlds.deepracer.training.glossary import GLOSSARY, Term

    def code(names: str) -> str:
        return ", ".join(f"`{name.strip()}`" for name in names.split(",") if name.strip())

    def elsewhere(term: Term) -> str:
        worlds = {"JSON": term.json, "run.env": term.variable, "racecraft": term.ours}
        return "; ".join(f"{world} {code(names)}" for world, names in worlds.items() if names)

    rows = [(term.console, term.meaning, elsewhere(term)) for term in GLOSSARY]
    return f"""# Glossary

One idea, four names: that of the AWS DeepRacer console, that of the JSON files (or of the dictionary that a reward
function is given), the variable of DeepRacer for Cloud, and ours. `racecraft explain WORD` searches it, and all of
[run.env](run_env.md) with it.

    racecraft explain lr
    racecraft explain gradient descent batch size

{_table(("in the console", "what it is", "elsewhere"), rows)}

## Words of the lessons

{_table(("word", "what it means"), [(word.name, str(word.meaning)) for word in WORDS])}"""


def track_pictures() -> dict[str, str]:
    """Return a small picture of every circuit: place under docs/ → SVG."""
    from racecraft.worlds.deepracer.tracks.catalogue import load_track, names
    from racecraft.worlds.deepracer.tracks.thumbnail import thumbnail_svg

    return {f"pictures/tracks/{name}.svg": thumbnail_svg(load_track(name)) for name in names()}


def gallery_page() -> str:
    """Return every circuit as a picture with its name."""
    from racecraft.worlds.deepracer.tracks.catalogue import names, summary

    picture = "width: 100%; margin: 0 0 6px; padding: 0; border: 0"
    cards = [
        f'<figure style="margin: 0"><a href="../pictures/tracks/{found.name}.svg"><img alt="{found.title}" '
        f'src="../pictures/tracks/{found.name}.svg" loading="lazy" style="{picture}"></a>'
        f"<figcaption><b>{found.title}</b><br><code>{found.name}</code><br>"
        f"{found.length:.1f} m · {found.width:.2f} m wide · {found.direction}</figcaption></figure>"
        for found in sorted(map(summary, names()), key=lambda found: (found.title.casefold(), found.name))
    ]
    return f"""# Gallery

All {len(cards)} circuits, drawn by racecraft from the shapes its cars race on. The white bar is the start line, the
arrow points the way. The names below the titles are what `--track` takes; [Tracks](tracks.md) has the figures in one
table.

<div style="display: grid; grid-template-columns: repeat(auto-fill, minmax(200px, 1fr)); gap: 24px 18px">
{chr(10).join(cards)}
</div>

`racecraft tracks show NAME --picture FILE.png` draws one large, with its waypoints numbered."""


def worlds_page() -> str:
    """Return the card of every world that can be trained from the command line."""
    from racecraft.worlds.deepracer.env import world

    return (
        "# Worlds\n\nA world's card says what it promises; it stands at the top of the world's own file.\n\n"
        + _card("DeepRacer", inspect.cleandoc(world.__doc__ or ""))
    )


def fidelity_page() -> str:
    """Return where our car world departs from the original, and how to bring each habit back."""
    from racecraft.worlds.deepracer.env.fidelity import KEPT_IN_BOTH, NOT_EMULATED, as_table

    return f"""# Fidelity

Where the original's habits are bugs, there are two worlds: `race.fidelity` is `sane` or `aws`.

{as_table()}

Kept in both, because racers' files rely on it:

{_list(KEPT_IN_BOTH)}

In neither, because it would be dishonest or of no use to rebuild:

{_list(NOT_EMULATED)}"""


def variation_page() -> str:
    """Return the disturbances, what each level has of them, and what is written down of an episode."""
    from racecraft.worlds.deepracer.env.variation import DRAWN, LEVELS, as_table

    drawn = _table(("field", "unit", "meaning"), [(f"`{one.name}`", one.unit, one.doc) for one in DRAWN])
    levels = _list(f"`{name}`: {meaning}" for name, meaning in LEVELS.items())
    return f"""# Variation, disturbance by disturbance

{levels}

A number is the most by which something may stray; each episode of each car draws its own, evenly within. What
is empty stays as it is. [Variation](../racing/variation.md) tells how to use it.

{as_table()}

## What an episode drew

Where episodes differ, `episodes/*.parquet` has a column `variation`, a record of these numbers, the same in every row
of an episode; behind them come `grey_field`, `grey_road` and so on, the grey level that each material showed, and
`grey_object_0` and so on of every box or bot.

{drawn}"""


def coach_page() -> str:
    """Return what Coach's words mean here."""
    from racecraft.compat.coach_config import AGENT_WORDS, AGENTS, TABLE

    rows = [
        f"| `{name}` | {f'`…{what}`' if how == TABLE else what if how else f'nothing: {what}'} |"
        for name, (how, what) in AGENT_WORDS.items()
    ]
    return "\n".join(
        [
            "# Coach's words",
            "",
            "What may be laid into `agent_params` of a preset, and what it is here; see [your old SageMaker "
            "notebook](../jobs/sagemaker.md). `…` is the algorithm's group.",
            "",
            "| Coach | here |",
            "|---|---|",
            *rows,
            "",
            "Agents: " + ", ".join(f"`{name}` ({ours})" for name, ours in AGENTS.items()) + ".",
        ]
    )


def baselines_page() -> str:
    """Return what Stable-Baselines' words mean here."""
    from racecraft.compat.baselines_config import DEFAULTS, WORDS

    rows = [(f"`{name}`", f"`{setting}`" if setting else doc) for name, (setting, doc) in WORDS.items()]
    return f"""# Stable-Baselines' words

What the arguments of `SagemakerStableBaselinesPPO1Launcher` mean here; see [your old SageMaker
notebook](../jobs/sagemaker.md).

{_table(("PPO1", "here"), rows)}

What PPO1 and its `MlpPolicy` do without being asked: {", ".join(f"`{one}`" for one in DEFAULTS)}."""


def rllib_page() -> str:
    """Return what RLlib's words mean here."""
    from racecraft.compat.rllib_defaults import defaults_of
    from racecraft.compat.rllib_words import (
        ALGORITHMS,
        CALLBACK_WORDS,
        ELSEWHERE,
        ES_WORDS,
        EXPERIMENT_WORDS,
        LATER_NAMES,
        LATER_STOPS,
        MODEL_WORDS,
        MULTI_WORDS,
        RUNS,
        SAC_WORDS,
        STOPS,
        VALUE_WORDS,
        WORDS,
    )  # fmt: skip

    def rows_of(run: str, words: Mapping[str, Any], known: Mapping[str, Any]) -> list[str]:
        rows, defaults = [], defaults_of(run)
        for name, word in words.items():
            setting = "" if word.setting in ("", ELSEWHERE) else f"`{word.setting}`"
            default = f"`{defaults[name]!r}`" if name in defaults else ""
            if known.get(name) != word:
                meaning = word.doc if word.setting else f"nothing: {word.doc}"
                rows.append(f"| `{name}` | {default} | {setting} | {meaning} |")
        return ["| RLlib | its default | setting | what it means here |", "|---|---|---|---|", *rows]

    runs = [
        f"| `{name}` | `--algorithm {ALGORITHMS[name]}`{''.join(f' `--set {one}`' for one in more)} |"
        for name, more in RUNS.items()
    ]
    stops = [
        f"| `{name}` | `--stop {ours}=…`{', seconds become minutes' if ours == 'minutes' else ''} |"
        for name, ours in STOPS.items()
    ]
    return "\n".join(
        [
            "# RLlib's words",
            "",
            "What the words of a launcher script's `config` mean here; see [your old SageMaker "
            "notebook](../jobs/sagemaker.md).",
            "",
            "Where a script says nothing, RLlib's default holds. A key of RLlib's in no table passes at its "
            "default and is refused at another value.",
            "",
            *rows_of("PPO", WORDS, {}),
            "",
            "With DQN and APEX what is PPO's alone is not known, and these mean something else or something at all.",
            "Where a setting begins with `dqn.`, it begins with `apex.` for APEX:",
            "",
            *rows_of("DQN", VALUE_WORDS, WORDS),
            "",
            "With SAC:",
            "",
            *rows_of("SAC", SAC_WORDS, VALUE_WORDS),
            "",
            "With ES:",
            "",
            *rows_of("ES", ES_WORDS, WORDS),
            "",
            "Words of `model`:",
            "",
            "| RLlib | here |",
            "|---|---|",
            *(f"| `{name}` | {told} |" for name, told in MODEL_WORDS.items()),
            "",
            "Words of `multiagent`:",
            "",
            "| RLlib | here |",
            "|---|---|",
            *(f"| `{name}` | {told} |" for name, told in MULTI_WORDS.items()),
            "",
            "Words of `callbacks`, functions by name or methods of a class of `DefaultCallbacks`:",
            "",
            "| RLlib | here |",
            "|---|---|",
            *(f"| `{name}` | {told} |" for name, told in CALLBACK_WORDS.items()),
            "",
            "What Ray 2 calls otherwise:",
            "",
            "| Ray 2 | in the tables |",
            "|---|---|",
            *(f"| `{name}` | `{first}` |" for name, first in {**LATER_NAMES, **LATER_STOPS}.items()),
            "",
            "Words of an experiment, and of `tune.run`:",
            "",
            "| RLlib | here |",
            "|---|---|",
            *(f"| `{name}` | {told} |" for name, told in EXPERIMENT_WORDS.items()),
            "",
            "Words of `run`:",
            "",
            "| RLlib | here |",
            "|---|---|",
            *runs,
            "",
            "Words of `stop`:",
            "",
            "| RLlib | here |",
            "|---|---|",
            *stops,
        ]
    )


def package_pages() -> dict[str, str]:
    """Return a page for each package: what it is for, where to begin, and what each of its modules does."""
    source = DOCS.parent / "src" / "racecraft"
    tops = [path for path in sorted(source.iterdir()) if (path / "__init__.py").exists() and path.name != "worlds"]
    tops += [path for path in sorted((source / "worlds").iterdir()) if (path / "__init__.py").exists()]
    made = {_package_place(top): _package_page(top, source) for top in tops}
    rows = [
        f"| [`{top.relative_to(source).as_posix()}`]({top.name}.md) | {_summary(top / '__init__.py')} |" for top in tops
    ]
    head = "# Packages\n\nOne core and worlds as packages; imports point down as ARCHITECTURE.md draws it.\n\n"
    made["packages/index.md"] = head + "\n".join(["| package | |", "|---|---|", *rows])
    return {place: f"{NOTE}\n\n{text.strip()}\n" for place, text in made.items()}


def _package_place(top: Path) -> str:
    return f"packages/{top.name}.md"


def _package_page(top: Path, source: Path) -> str:
    """Return the page of a package, with the packages inside it as sections."""
    folders = [
        top,
        *sorted(path for path in top.rglob("*") if (path / "__init__.py").exists() and "names" not in path.parts),
    ]
    parts = []
    for folder in folders:
        name = folder.relative_to(source).as_posix()
        modules = [path for path in sorted(folder.glob("*.py")) if path.name not in ("__init__.py", "__main__.py")]
        rows = [f"| `{path.name}` | {_summary(path)} |" for path in modules]
        table = "\n".join(["| module | |", "|---|---|", *rows]) if rows else ""
        parts.append(f"{'#' if folder == top else '##'} {name}\n\n{_docstring(folder / '__init__.py')}\n\n{table}")
    return "\n\n".join(parts)


def _summary(path: Path) -> str:
    """Return the first paragraph of a module's docstring, on one line, for a cell of a table."""
    return " ".join(_docstring(path).split("\n\n")[0].split()).replace("|", "\\|")


def _docstring(path: Path) -> str:
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""


PAGES: dict[str, Callable[[], str]] = {
    "reference/settings.md": settings_page,
    "reference/cli.md": command_page,
    "reference/reward_parameters.md": reward_page,
    "reference/episode_columns.md": episode_page,
    "reference/metrics.md": metrics_page,
    "reference/run_env.md": run_env_page,
    "reference/glossary.md": glossary_page,
    "reference/tracks.md": tracks_page,
    "reference/best_laps.md": best_laps_page,
    "reference/gallery.md": gallery_page,
    "reference/worlds.md": worlds_page,
    "reference/fidelity.md": fidelity_page,
    "reference/variation.md": variation_page,
    "reference/rllib.md": rllib_page,
    "reference/coach.md": coach_page,
    "reference/baselines.md": baselines_page,
}
"""Every generated page and the function that writes it."""


def commands(app: typer.Typer, prefix: str = "racecraft") -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield (full name, function) of every command, groups walked through, in the order of `--help`."""
    for command in app.registered_commands:
        function = command.callback
        assert function is not None
        yield f"{prefix} {command.name or function.__name__.replace('_', '-')}", function
    for group in app.registered_groups:
        assert group.typer_instance is not None
        yield from commands(group.typer_instance, f"{prefix} {group.name}")


def options_of(function: Callable[..., Any]) -> Iterator[tuple[str, str, str, str]]:
    """Yield (name as typed, value, default, help) of each argument and option of a command."""
    hints = typing.get_type_hints(function, include_extras=True)
    for name, parameter in inspect.signature(function).parameters.items():
        if typing.get_origin(hints[name]) is not typing.Annotated:
            continue  # the command's own context
        kind, info = typing.get_args(hints[name])[:2]
        is_argument = type(info).__name__ == "ArgumentInfo"
        typed = _typed_name(name, kind, info, is_argument)
        required = parameter.default is inspect.Parameter.empty
        default = "required" if required else _default_text(parameter.default)
        value = NUMBERS.get(info.metavar) or _value_text(kind)
        yield typed, "" if is_argument else value, default, str(info.help or "")


NUMBERS = {"<int>": "whole number", "<float>": "number"}
"""What they are called, by what `--help` shows for them."""


def _typed_name(name: str, kind: Any, info: Any, is_argument: bool) -> str:
    if is_argument:
        return str(info.metavar or name.upper())
    given = [text for text in (info.default, *(info.param_decls or ())) if isinstance(text, str)]
    dashed = name.replace("_", "-")
    return " ".join(given) or (f"--{dashed}, --no-{dashed}" if kind is bool else f"--{dashed}")


def _value_text(kind: Any) -> str:
    """Return what follows an option: a path, a number, text; nothing after a flag."""
    parts = [part for part in typing.get_args(kind) if part is not type(None)] or [kind]
    if parts[0] is bool:
        return ""
    if typing.get_origin(parts[0]) is list or typing.get_origin(kind) is list:
        return "text, may be repeated"
    return {Path: "path", int: "whole number", float: "number", str: "text"}[parts[0]]


def _default_text(value: Any) -> str:
    if value is None or value is False:
        return ""
    return "on" if value is True else f"`{value}`"


def _command_section(name: str, function: Callable[..., Any]) -> str:
    """Return heading, help and table of one command; example lines become a block."""
    help_text, _, examples = inspect.cleandoc(function.__doc__ or "").partition("\n\nExample")
    lines = [line.strip() for line in examples.lstrip("s:").splitlines() if line.strip()]
    block = "".join(f"\n    {line}" for line in lines)
    table = _table(("argument or option", "value", "default", "what it does"), list(_code_first(options_of(function))))
    return f"## {name}\n\n{help_text}\n" + (f"{block}\n" if block else "") + f"\n{table}\n"


def _code_first(rows: Iterator[tuple[str, str, str, str]]) -> Iterator[tuple[str, ...]]:
    for first, *others in rows:
        yield f"`{first}`", *others


def _card(title: str, text: str) -> str:
    """Return a card, "What it is    one line, continued …", as a table under its first line."""
    first, _, body = text.partition("\n\n")
    rows: list[list[str]] = []
    for line in body.splitlines():
        if line.startswith(" ") and rows:
            rows[-1][1] += f" {line.strip()}"
        elif line.strip():
            rows.append([line[:CARD_LABEL].strip(), line[CARD_LABEL:].strip()])
    return f"## {title}\n\n{first}\n\n{_table(('', ''), [(f'**{label}**', value) for label, value in rows])}\n"


def _table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [heads, tuple("---" for _ in heads), *rows]
    return "\n".join("| " + " | ".join(map(_cell, line)) + " |" for line in lines)


def _list(lines: Iterable[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)


def _cell(text: str) -> str:
    """Return text that stays within its cell and is no HTML.

    >>> _cell("`<a>` makes runs/<id>")
    '`<a>` makes runs/&lt;id>'
    """
    parts = text.replace("|", "\\|").split("`")
    return "`".join(part if number % 2 else part.replace("<", "&lt;") for number, part in enumerate(parts))


def _is_current(path: Path, text: str) -> bool:
    return path.is_file() and path.read_text(encoding="utf-8") == text


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

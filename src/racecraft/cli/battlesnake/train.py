"""`racecraft snakes train`: a snake that learns by playing against itself, its past and the built-in players."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.battlesnake.options import JSON
from racecraft.cli.buckets.training import MirrorAt
from racecraft.cli.metrics_beside import MetricsPort, measured
from racecraft.cli.options import DEFAULT, AlgorithmName, Cluster, Detach, From, Overrides, Resume, asked
from racecraft.cli.resuming import refuse_changes
from racecraft.cli.runs.report import Pictures, leave_report

if TYPE_CHECKING:
    from racecraft.envs.battlesnake.settings import GameSettings

UNCHANGEABLE = ("width", "height", "size", "snakes", "ruleset", "map_", "seed", "algorithm", "set_", "from_", "anchors")


def train(
    context: typer.Context,
    size: Annotated[int, typer.Option(help="Side of the board, in squares.")] = 11,
    width: Annotated[
        int | None, typer.Option("--width", "-W", help="Squares from left to right, where it is not --size.")
    ] = None,
    height: Annotated[
        int | None, typer.Option("--height", "-H", help="Squares from bottom to top, where it is not --size.")
    ] = None,
    snakes: Annotated[int, typer.Option(help="Snakes at a board.")] = 4,
    ruleset: Annotated[str, typer.Option("--ruleset", "-g", help="standard, royale, constrictor, wrapped, …")] = (
        "standard"
    ),
    map_: Annotated[str, typer.Option("--map", "-m", help="standard, empty, royale, arcade_maze, …")] = "standard",
    stop: Annotated[
        list[str] | None,
        typer.Option(help="rating=1900, minutes=10, iterations=50, steps=200000; may be repeated."),
    ] = None,
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/snakes-N.")] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same machine, same training.")] = 1,
    anchors: Annotated[
        list[str] | None,
        typer.Option(help="A foreign snake to learn against: URL of a server, RUN, FILE.py or name; may be repeated."),
    ] = None,
    algorithm: AlgorithmName = DEFAULT,
    set_: Overrides = None,
    from_: From = None,
    resume: Resume = False,
    detach: Detach = False,
    cluster: Cluster = None,
    mirror: MirrorAt = None,
    metrics_port: MetricsPort = None,
    pictures: Pictures = True,
    json: JSON = False,
) -> None:
    """Train a snake by self-play; its rating against the built-in players is shown as it learns.

    Examples:

        racecraft snakes train --snakes 2 --stop minutes=10

        racecraft snakes train --size 7 --ruleset wrapped --set selfplay.anchor_share=0.3

        racecraft snakes train --snakes 2 --algorithm alphazero --from runs/snakes-1 --anchors http://localhost:8000

        racecraft snakes train --run runs/snakes-1 --resume --stop minutes=20
    """
    from racecraft.cli.buckets.training import fetch_run, mirrored, place_of_mirror
    from racecraft.cli.jobs.detaching import detach_training
    from racecraft.cli.output import print_json, say
    from racecraft.cluster.spreading import spread_over
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.training.battlesnake.trainer import SnakeRequest
    from racecraft.training.progress import watcher
    from racecraft.training.worlds import resume as resume_run
    from racecraft.training.worlds import train as train_world

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    spread = spread_over(cluster)
    begun = refuse_changes(context, run, UNCHANGEABLE, "runs/snakes-1") if resume else None
    place, request = place_of_mirror(mirror, None, begun, tell), None
    if begun is None:
        game = GameSettings(width or size, height or size, snakes, ruleset, map_)
        foreign = [f"selfplay.foreign={','.join(anchors)}"] if anchors else []
        source = None if from_ is None else fetch_run(from_, tell)
        request = SnakeRequest(game, **asked(algorithm, stop, run, seed, [*(set_ or ()), *foreign], source))
    shown = watcher(sys.stderr if json else sys.stdout)
    watching = measured(shown, metrics_port, run.name if run is not None else "snakes", tell, detach)
    if detach:
        return detach_training(context, run, request, json)
    with mirrored(watching, place, tell, begun) as mirroring:
        if begun is not None:
            trained = resume_run(begun, tuple(stop or ()), mirroring, tell, "battlesnake", spread)
        else:
            assert request is not None
            trained = train_world(request, mirroring, tell, spread)
        summary, files = trained.summary(), leave_report(trained.run.path, tell) if pictures else {}
    if json:
        print_json({**summary, **files})
        return
    judged, folder = summary["evaluation"], trained.run.path
    print(f"{summary['env_steps']:,} steps; run: {folder}")
    if judged is None:
        print("stopped before its first evaluation")
        return
    print(f"rating {judged['rating']:.0f} (95 %: {judged['rating_low']:.0f} to {judged['rating_high']:.0f}); won:")
    for name, told in judged["against"].items():
        print(f"  {told['won']:3} of {told['games']} against {name}")
    same = _same_game(GameSettings(**summary["game"]))
    print(f"next: racecraft snakes play --url {folder} --url flood_fill --view{same}")


def _same_game(game: GameSettings) -> str:
    """Return the options that make `snakes play` play what was trained, where they are not its defaults."""
    asked = {"-W": game.width, "-H": game.height, "-g": game.ruleset, "-m": game.map}
    usual = {"-W": 11, "-H": 11, "-g": "standard", "-m": "standard"}
    return "".join(f" {flag} {value}" for flag, value in asked.items() if value != usual[flag])

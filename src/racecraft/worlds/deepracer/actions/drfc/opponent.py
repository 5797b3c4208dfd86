"""`dr-start-evaluation` in HEAD_TO_MODEL: the model of run.env races the one that DR_EVAL_OPP_… names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.contract.message import Message
from racecraft.contract.progress import Progress
from racecraft.worlds.deepracer.actions.race import Raced
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.evaluation.head_to_head import RaceResult
    from racecraft.worlds.deepracer.players.driver import Driver
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track

DONE_CONDITION = "any"
"""The original's race is over with the first car that finishes (facts: deepracer.md 6.3)."""


def race_opponent(drfc: DrfcFolder, model: Path, request: Mapping[str, Any], progress: Progress) -> Raced:
    """Race a model against the opponent of run.env, one race, and leave AWS's files with both.

    Args:
        drfc: The installation.
        model: The run folder of the car that is judged.
        request: What run.env says of judging, as `race_rules.judging_in_drfc` returns it.
        progress: Receives messages.

    Raises:
        UserInputError: There is no such opponent, or trials are asked for that each begin at rest.
    """
    from racecraft.worlds.deepracer.evaluation.head_to_head import HeadToHead, race_head_to_head
    from racecraft.worlds.deepracer.evaluation.mishap_rules import MishapRules
    from racecraft.worlds.deepracer.players.driver import driver_of, load_car
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    _require_race(drfc, request)
    which = request["checkpoint"]
    cars = [load_trained_car(model, which), load_car(f"{drfc.opponent}:{which}")]
    drivers = [driver_of(car, name) for car, name in zip(cars, _names(drfc), strict=True)]
    mishaps = {name: request[name] for name in (one.name for one in fields(MishapRules)) if name in request}
    rules = HeadToHead(request["laps"], races=1, done_condition=DONE_CONDITION, **mishaps)
    named = drfc.env.run.values.get("DR_WORLD_NAME")
    circuit = load_track(named) if named else cars[0].trained_on
    config = replace(cars[0].settings.race, reverse=request["reverse_direction"])
    result = race_head_to_head(drivers, circuit, rules, config)
    _leave_files((model, drfc.opponent), result, circuit.length, progress)
    if drfc.flag("DR_EVAL_SAVE_MP4"):
        track = circuit.reversed() if config.reverse else circuit
        _film(drfc, cars[0], drivers, result, track, progress)
    return Raced(circuit, rules.laps, result, (), {})


def _require_race(drfc: DrfcFolder, request: Mapping[str, Any]) -> None:
    if not request["is_continuous"]:
        raise drfc.error_at(
            "DR_EVAL_IS_CONTINUOUS", "True where cars race each other: their laps are one drive", found="it is False"
        )
    if not drfc.opponent.is_dir():
        raise drfc.error_at(
            "DR_EVAL_OPP_S3_MODEL_PREFIX",
            "the prefix of a trained model in the bucket",
            "Train one there, or name another.",
            found=Message("there is no {opponent}", opponent=drfc.opponent),
        )


def _names(drfc: DrfcFolder) -> tuple[str, str]:
    own, opponent = drfc.text("DR_DISPLAY_NAME"), drfc.text("DR_EVAL_OPP_DISPLAY_NAME")
    return (own, opponent) if own != opponent else (f"{own} (1)", f"{opponent} (2)")


def _leave_files(models: Sequence[Path], result: RaceResult, length_m: float, progress: Progress) -> None:
    """Write trace and metrics of both cars, each into its own model's folder."""
    from racecraft.worlds.deepracer.training.aws.head_to_head_files import write_aws_heads

    for number, model in enumerate(models):
        stamp = write_aws_heads(model, result.ticks[0][:, number], length_m)
        progress(f"{result.drivers[number]}: evaluation-{stamp} in {model}")


def _film(
    drfc: DrfcFolder, car: TrainedCar, drivers: list[Driver], result: RaceResult, track: Track, progress: Progress
) -> None:
    from racecraft.formats.atomic import make_folder
    from racecraft.worlds.deepracer.analysis.films.film import FilmStyle
    from racecraft.worlds.deepracer.analysis.films.views import AWS_FOLDERS
    from racecraft.worlds.deepracer.analysis.race_film import film_race

    shells = (drfc.text("DR_EVAL_OPP_CAR_BODY_SHELL_TYPE"),)
    for view, folder in AWS_FOLDERS.items():
        place = car.run.path / "mp4" / folder / f"{car.checkpoint.iteration}-video.mp4"
        make_folder(place.parent)
        style = FilmStyle(view, shell=drfc.text("DR_CAR_BODY_SHELL_TYPE"))
        progress(str(film_race(result, drivers, track, place, style, shells)["video"]))

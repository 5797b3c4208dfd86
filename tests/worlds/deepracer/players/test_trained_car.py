"""A run folder whose network and car do not belong together is named before a tick is driven."""

import copy
import shutil

import pytest
from tests.cli.conftest import TINY

from racecraft.contract.errors import RunFolderError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.training.plan import RaceRequest


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    place = tmp_path_factory.mktemp("cars") / "car"
    request = RaceRequest(preset="fast", run=place, stops=("iterations=1",), overrides=TINY[1::2])
    return train(request, NullCallback(), lambda text: None).run.path


def exchanged(run, place, change):
    """Return a copy of a run in which what its checkpoint says of itself is changed in place."""
    shutil.copytree(run, place)
    weights, card = Checkpoints(place / "checkpoints").load_policy("1")
    card = copy.deepcopy(dict(card))
    change(card)
    shutil.rmtree(place / "checkpoints")
    (place / "checkpoints").mkdir()
    Checkpoints(place / "checkpoints").save(1, 64, weights, card, score=1.0, best=True)
    return place


def actions(card, change):
    card["model_metadata"]["action_space"] = change(card["model_metadata"]["action_space"])


RANGES = {"speed": {"low": 0.5, "high": 2.0}, "steering_angle": {"low": -30.0, "high": 30.0}}
EXCHANGES = {
    "fewer actions": (lambda card: actions(card, lambda told: told[:3]), "decides by 10 actions, .* has 3 actions"),
    "ranges": (lambda card: actions(card, lambda told: RANGES), "decides by 10 actions, .* has two ranges"),
    "another sensor": (
        lambda card: card["model_metadata"].update(sensor=["STEREO_CAMERAS"]),
        "sees FRONT_FACING_CAMERA of 12x16, and its car STEREO_CAMERAS of 12x16x2",
    ),
    "another frame": (lambda card: card["settings"]["camera"].update(width=40), "sees .* of 12x16, .* of 12x40"),
    "no car": (lambda card: card.pop("model_metadata"), "does not say what car it drives"),
}


@pytest.mark.parametrize("case", EXCHANGES)
def test_a_network_that_is_not_its_cars_is_named(run, tmp_path, case):
    change, said = EXCHANGES[case]
    with pytest.raises(RunFolderError, match=said):
        load_trained_car(exchanged(run, tmp_path / "car", change))


def test_a_cars_other_angles_and_speeds_and_a_lidar_it_does_not_heed_are_nobodys_affair(run, tmp_path):
    def change(card):
        for action in card["model_metadata"]["action_space"]:
            action["speed"] = 0.7
        card["model_metadata"]["sensor"].append("LIDAR")

    assert set(load_trained_car(exchanged(run, tmp_path / "car", change)).actions.speed) == {0.7}

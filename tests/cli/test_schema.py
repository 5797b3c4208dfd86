"""`racecraft schema`: what programs rely on."""

import json

from racecraft.cli.app import app
from racecraft.cli.schema import schemas
from racecraft.worlds.deepracer.cli.dr.removed import SENTENCES


def test_what_json_prints_has_the_shape_of_its_schema(racecraft):
    told = json.loads(racecraft("algorithms", "--json").out)
    [schema] = json.loads(racecraft("schema", "algorithms").out)["commands"].values()
    assert told.keys() == schema["result"]["properties"].keys()
    row = schema["result"]["properties"]["algorithms"]["items"]
    assert told["algorithms"][0].keys() == row["properties"].keys()


def test_options_have_their_type_default_and_bounds():
    options = schemas(app)["actions"]["request"]
    assert options["required"] == ["tracks"]
    assert options["properties"]["tracks"]["type"] == "array"
    count = options["properties"]["count"]
    assert (count["type"], count["default"], count["minimum"], count["maximum"]) == ("integer", 10, 4, 30)


def test_a_group_of_commands_is_chosen_and_another_name_is_refused(racecraft):
    assert {"snakes play", "snakes arena add"} <= json.loads(racecraft("schema", "snakes").out)["commands"].keys()
    said = racecraft("schema", "snakes", "plai")
    assert (said.code, "Did you mean 'snakes play'" in said.err) == (2, True)


def by_hand(app, before=""):
    """Yield the commands that are not made from an action, by the words that are typed."""
    for one in app.registered_commands:
        if not hasattr(one.callback, "action"):
            yield f"{before}{one.name or one.callback.__name__}"
    for group in app.registered_groups:
        yield from by_hand(group.typer_instance, f"{before}{group.name} ")


def test_commands_are_made_from_actions_but_for_those_of_decision_16():
    found = {name for name in by_hand(app) if not name.startswith("dr ")}
    assert found == {"run", "jobs enter"}
    assert {name for name in by_hand(app) if name.startswith("dr ")} == {f"dr {name}" for name in SENTENCES}

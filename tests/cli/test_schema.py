"""`racecraft schema`: what programs rely on."""

import json

from racecraft.cli.app import app
from racecraft.cli.schema import schemas


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

"""Templates: what CloudFormation's functions come to, and what it refuses, with the line."""

import pytest

from racecraft.sagemaker.cloudformation.functions import Functions, NotHereError
from racecraft.sagemaker.cloudformation.parameters import ParameterError, redact, resolve_parameters
from racecraft.sagemaker.cloudformation.template import Output, Resource, TemplateError, read_template

HEAD = """\
Parameters:
  Size: {Type: String, Default: 007}
  Zones: {Type: CommaDelimitedList, Default: "a, b,c"}
Mappings:
  Prices: {us-east-1: {day: 3}, Tokyo: {day: 4}}
Conditions:
  Small: !Equals [!Ref Size, 007]
  Both: !And [!Condition Small, {"Fn::Not": [!Equals [x, y]]}]
  Neither: !Not [!Or [!Condition Small, !Condition Both]]
Resources:
  Box: {Type: "AWS::S3::Bucket"}
"""


class Names:
    def name_of(self, resource, at):
        return f"the-{resource}"

    def attribute_of(self, resource, attribute, at):
        return f"the-{resource}'s-{attribute}"


def written(tmp_path, text):
    path = tmp_path / "t.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def functions(tmp_path, output):
    template = read_template(written(tmp_path, f"{HEAD}Outputs:\n  It:\n    Value: {output}\n"))
    values = {**resolve_parameters(template, {}), "AWS::Region": "here"}
    return Functions(template, values, Names()), template.outputs["It"].value


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ("!Ref Size", "007"),
        ("{Ref: Box}", "the-Box"),
        ("!GetAtt Box.Arn", "the-Box's-Arn"),
        ("!Sub '${Size}/${Box}/${Box.Arn}/${!Kept}/$x'", "007/the-Box/the-Box's-Arn/${Kept}/$x"),
        ("!Sub ['${A}-${Size}', {A: !Ref Box}]", "the-Box-007"),
        ("!Join ['-', [a, !Ref Size, !Ref 'AWS::Region']]", "a-007-here"),
        ("!FindInMap [Prices, Tokyo, day]", "4"),
        ("!If [Small, yes it is, !Ref Box]", "yes it is"),
        ("{a: !Ref AWS::NoValue, b: [!Ref AWS::NoValue, c]}", {"b": ["c"]}),
        ("!And [!Condition Small, !Condition Both, !Not [!Condition Neither]]", True),
        ("!Or [!Condition Small, !Condition Neither]", True),
        ("!Equals [!Ref Zones, [a, b, c]]", True),
        ("{Condition: {StringEquals: {a: !Ref Size}}}", {"Condition": {"StringEquals": {"a": "007"}}}),
    ],
)
def test_functions_come_to_what_the_reference_says(tmp_path, asked, expected):
    worker, value = functions(tmp_path, asked)
    assert worker.value(value, ("Outputs", "It", "Value")) == expected


def test_conditions_hold_as_they_are_written(tmp_path):
    worker, _ = functions(tmp_path, "x")
    assert [worker.holds(name) for name in ("Small", "Both", "Neither", None)] == [True, True, False, True]


def test_a_mapping_by_region_has_a_row_that_stands_in_and_says_so(tmp_path):
    worker, value = functions(tmp_path, "!FindInMap [Prices, !Ref AWS::Region, day]")
    assert worker.value(value, ()) == "3"
    assert worker.value(value, ()) == "3"
    assert worker.notes == ["mapping Prices has no region 'here'; its row us-east-1 is taken"], "told once"


@pytest.mark.parametrize("asked", ["!ImportValue other-stack", "!Select [0, [a]]", "!Join ['', !Split [',', 'a,b']]"])
def test_a_function_that_is_not_here_is_named_with_its_line(tmp_path, asked):
    worker, value = functions(tmp_path, asked)
    with pytest.raises(NotHereError, match=r"t\.yaml:14: Fn::\w+ is not here"):
        worker.value(value, ("Outputs", "It", "Value"))


def test_a_condition_that_waits_for_itself_is_refused(tmp_path):
    text = "Conditions:\n  C: !Not [!Condition C]\nResources: {A: {Type: T}}"
    worker = Functions(read_template(written(tmp_path, text)), {}, Names())
    with pytest.raises(TemplateError, match=r"t\.yaml:2: .*a condition that waits for itself"):
        worker.holds("C")


@pytest.mark.parametrize(
    ("text", "letter"),
    [
        ("Resources: [", r"t\.yaml:\d: not YAML"),
        ("Resource: {}\nResources: {A: {Type: T}}", r"t\.yaml:1: Resource: an unknown.*Did you mean 'Resources'"),
        ("Resources:\n  A: {Type: T}\n  A: {Type: U}", r"t\.yaml:3: .*stands twice \(first in line 2\)"),
        ("Resources:\n  A: !!python/object:os.system {Type: T}", "the tag tag:yaml.org,2002:python/object:os.system"),
        ("Resources:\n  A: !Reff x", r"t\.yaml:2: .*the tag !Reff.*Did you mean 'Ref'"),
    ],
)
def test_what_cannot_be_used_is_refused_with_its_line(tmp_path, text, letter):
    with pytest.raises(TemplateError, match=letter):
        read_template(written(tmp_path, text))


def test_a_template_says_what_it_is_for_and_what_is_made_under_which_condition(tmp_path):
    text = """\
Description: " A box. "
Conditions: {Small: !Equals [a, a]}
Resources:
  Box: {Type: "AWS::S3::Bucket", Condition: Small, Properties: {Name: b}}
  Bare: {Type: T}
Outputs:
  It: {Value: !Ref Box, Description: " its name ", Condition: Small}
  Other: {Value: a}
"""
    template = read_template(written(tmp_path, text))
    assert template.description == "A box."
    assert template.resources["Box"] == Resource("Box", "AWS::S3::Bucket", {"Name": "b"}, "Small")
    assert template.resources["Box"].at == ("Resources", "Box", "Properties")
    assert template.resources["Bare"] == Resource("Bare", "T", {}, None)
    assert list(template.outputs.values()) == [
        Output("It", {"Ref": "Box"}, "its name", "Small"), Output("Other", "a", "", None),
    ]  # fmt: skip
    assert read_template(written(tmp_path, "Outputs:\nResources: {A: {Type: T}}")).description == ""


def test_one_name_may_stand_for_a_parameter_and_a_condition_as_in_the_workshops_template(tmp_path):
    text = "Parameters:\n  Make: {Type: String}\nConditions:\n  Make: !Equals [!Ref Make, True]\n"
    assert read_template(written(tmp_path, f"{text}Resources: {{A: {{Type: T}}}}")).conditions


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("!Bar x", "a function of CloudFormation"),
        ("!GetAtt [Box]", "a resource and an attribute"),
        ("!Sub '${Zones}'", "a list of 3; expected a word"),
        ("!Sub {a: b}", "a text, or a text and a group of names"),
        ("!Join [a, [{b: c}]]", "a list of words"),
        ("!If [Small, 1]", "a list of 3"),
        ("!FindInMap [!Join ['', [Pri, ses]], Tokyo, day]", "a mapping"),
        ("!FindInMap [Prices, Tokyo, night]", "a column of Prices"),
        ("!Not [!Ref Size]", "Fn::Equals, Fn::And, Fn::Or, Fn::Not or Condition"),
        (f"!Or [{', '.join(['!Condition Small'] * 11)}]", "two to ten conditions"),
    ],
)
def test_a_function_that_is_given_what_it_cannot_use_is_refused(tmp_path, value, expected):
    def worked_out():
        worker, told = functions(tmp_path, value)
        return worker.value(told, ("Outputs", "It", "Value"))

    with pytest.raises(TemplateError, match=rf"t\.yaml:14: .*{expected}"):
        worked_out()


def test_json_is_read_too(tmp_path):
    path = written(tmp_path, '{\n\t"Resources": {\n\t\t"A": {"Type": "T", "Properties": {"X": {"Ref": "B"}}}}}')
    assert read_template(path).resources["A"].properties == {"X": {"Ref": "B"}}


def test_parameters_are_held_to_what_the_template_allows(tmp_path):
    text = """\
Parameters:
  Make: {Type: String, Default: True, AllowedValues: [True, False], ConstraintDescription: one of two}
  Name: {Type: String}
  Secret: {Type: String, NoEcho: true, Default: psst, AllowedValues: [psst, pst]}
Resources: {A: {Type: T}}
"""
    template = read_template(written(tmp_path, text))
    values = resolve_parameters(template, {"Name": "abc", "Make": "False"})
    assert values == {"Make": "false", "Name": "abc", "Secret": "psst"}
    assert redact(template, values)["Secret"] == "****"
    for given, letter in (
        ({}, "Name: no value and no default.*Add --parameter Name=…"),
        ({"Name": "abc", "Make": "maybe"}, r"one of true, false.*\(one of two\)"),
        ({"Name": "abc", "Nam": "x"}, "no such parameter. Did you mean 'Name'"),
        ({"Name": "abc", "Secret": "x"}, r"Secret is \*\*\*\*; expected one of psst, pst"),
    ):
        with pytest.raises(ParameterError, match=letter):
            resolve_parameters(template, given)

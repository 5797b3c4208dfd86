"""What a template's places name: each kind of pointer is followed, and a circle is shown from where it closes."""

import pytest

from racecraft.sagemaker.cloudformation.source import TemplateError
from racecraft.sagemaker.cloudformation.template import read_template

pytest.importorskip("yaml", reason="pyyaml is not installed")

HEAD = "Mappings: {Prices: {here: {day: 3}}}\nConditions:\n  Small: !Equals [a, a]\nResources:\n  Box: {Type: T}\n"


def read(tmp_path, text):
    path = tmp_path / "t.yaml"
    path.write_text(text, encoding="utf-8")
    return read_template(path)


POINTERS = {
    "!Ref Gone": "points to 'Gone', which is not there; expected a parameter or a resource",
    "{'Fn::GetAtt': Gone.Box.Arn}": "points to 'Gone', which is not there; expected a resource",
    "{'Fn::GetAtt': [Gone, Arn]}": "points to 'Gone', which is not there; expected a resource",
    "!Sub '${ Gone }'": "points to 'Gone', which is not there; expected a parameter or a resource",
    "!Sub '${Gone.Box}'": "points to 'Gone', which is not there; expected a resource",
    "!Sub ['${A}${Gone}', {A: b}]": "points to 'Gone', which is not there; expected a parameter or a resource",
    "!Sub ['x', {A: !Ref Gone}]": "points to 'Gone', which is not there; expected a parameter or a resource",
    "!If [Gone, a, b]": "points to 'Gone', which is not there; expected a condition",
    "!FindInMap [Gone, here, day]": "points to 'Gone', which is not there; expected a mapping",
    "[a, {b: [c, !Ref Gone]}]": "points to 'Gone', which is not there; expected a parameter or a resource",
}


@pytest.mark.parametrize("value", POINTERS)
def test_a_name_that_is_nowhere_is_refused_by_what_it_should_be(tmp_path, value):
    with pytest.raises(TemplateError, match=rf"t\.yaml:6: Outputs\.It\.Value\S*: {POINTERS[value]} of this template"):
        read(tmp_path, f"{HEAD}Outputs: {{It: {{Value: {value}}}}}")


@pytest.mark.parametrize(
    "value",
    [
        "!Ref Box", "!Ref AWS::Region", "{'Fn::GetAtt': Box.Gone}", "{'Fn::GetAtt': [Box, Gone]}",
        "!Sub '${Box}${Box.Gone}${!Gone}'", "!Sub ['${Gone}', {Gone: a}]", "!Sub ab", "!If [Small, Gone, Gone]",
        "!FindInMap [Prices, Gone, Gone]", "{Condition: Gone}", "{Ref: [Gone]}", "!If []", "!GetAtt []",
    ],
)  # fmt: skip
def test_what_only_looks_like_a_name_is_none_here(tmp_path, value):
    """Some of these no function can use; that is said when they are worked out."""
    assert "It" in read(tmp_path, f"{HEAD}Outputs: {{It: {{Value: {value}}}}}").outputs


def test_what_outputs_and_resources_stand_under_is_a_condition_too(tmp_path):
    with pytest.raises(TemplateError, match=r"t\.yaml:6: Outputs\.It\.Condition: points to 'Box'.*a condition"):
        read(tmp_path, f"{HEAD}Outputs: {{It: {{Value: a, Condition: Box}}}}")
    with pytest.raises(TemplateError, match=r"t\.yaml:6: Resources\.B\.DependsOn: points to 'Small'"):
        read(tmp_path, f"{HEAD}  B: {{Type: T, DependsOn: [Box, Small]}}")


def test_conditions_point_to_conditions_and_nothing_else_of_theirs_does(tmp_path):
    text = "Conditions:\n  Both: !And [!Condition Small, {Condition: Gone}]\n  Small: !Equals [{a: Gone}, b]\n"
    letter = r"t\.yaml:2: Conditions\.Both\.Fn::And\.1\.Condition: points to 'Gone'.*a condition of this template"
    with pytest.raises(TemplateError, match=letter):
        read(tmp_path, f"{text}Resources: {{A: {{Type: T}}}}")
    assert read(tmp_path, f"{text.replace(', {Condition: Gone}', '')}Resources: {{A: {{Type: T}}}}").conditions


def test_a_circle_is_told_from_where_it_closes_and_its_way_in_is_not(tmp_path):
    ahead = "  A: {Type: T, DependsOn: B}\n  B:\n    Type: T\n    DependsOn: [Box, C]\n"
    closing = "".join(f"  {name}:\n    Type: T\n    Properties:\n      X: !Ref {to}\n" for name, to in ("CD", "DB"))
    letter = r"t\.yaml:17: Resources\.D\.Properties\.X\.Ref: waits for itself: B → C → D → B; expected"
    with pytest.raises(TemplateError, match=letter):
        read(tmp_path, f"{HEAD}{ahead}{closing}")


def test_two_ways_to_one_place_are_no_circle(tmp_path):
    ways = "  A: {Type: T, DependsOn: [B, C]}\n  B: {Type: T, DependsOn: D}\n  C: {Type: T, DependsOn: [D]}\n"
    assert list(read(tmp_path, f"{HEAD}{ways}  D: {{Type: T}}").resources) == ["Box", "A", "B", "C", "D"]

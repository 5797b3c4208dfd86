"""`racecraft sandbox`: a template shaped like the workshop's, and one with nested stacks like the snakes'."""

import json
import re
import sys

import pytest

from racecraft.cli.app import main
from racecraft.compat.shims import run_script

WORKSHOP = """\
Description: a driver's workshop
Parameters:
  MakeBucket: {Type: String, Default: True, AllowedValues: [True, False]}
  From: {Type: String, Default: course-files}
Conditions:
  MakeBucket: !Equals [!Ref MakeBucket, True]
Resources:
  Net: {Type: "AWS::EC2::VPC", Properties: {CidrBlock: 10.0.0.0/16}}
  Models:
    Type: AWS::S3::Bucket
    Condition: MakeBucket
    Properties:
      BucketName:
        Fn::Join: ["-", [models, Ref: AWS::Region, Ref: AWS::AccountId]]
  Config:
    Type: AWS::SageMaker::NotebookInstanceLifecycleConfig
    Properties:
      OnCreate:
        - Content:
            Fn::Base64: !Sub |
              cd SageMaker
              curl -O https://${From}.example.org/scripts/drive.ipynb
              curl -O https://${From}.example.org/scripts/drive.zip
              unzip drive.zip
              chown -R ec2-user /home/ec2-user/SageMaker
  Role: {Type: "AWS::IAM::Role", Properties: {}}
  Desk:
    Type: AWS::SageMaker::NotebookInstance
    Properties:
      NotebookInstanceName: !Join ["-", [Desk, !Ref "AWS::StackName"]]
      LifecycleConfigName: !GetAtt [Config, NotebookInstanceLifecycleConfigName]
      RoleArn: !GetAtt Role.Arn
Outputs:
  ModelBucket: {Condition: MakeBucket, Value: !Ref Models}
  Role: {Value: !GetAtt Role.Arn}
  Net: {Value: !Ref Net}
  Desk:
    Description: where to write
    Value: !Sub |
      https://console.aws.amazon.com/sagemaker/home?region=${AWS::Region}#/notebook-instances/${Desk.NotebookInstanceName}
"""
OUTER = """\
Resources:
  Api: {Type: "AWS::CloudFormation::Stack", Properties: {TemplateURL: "https://x/inner.yaml"}}
  Plain: {Type: "AWS::S3::Bucket"}
  Odd: {Type: "AWS::S3::Bucket", Properties: {BucketName: !Select [0, [a-bucket]]}}
Outputs:
  Snake: {Value: !GetAtt Api.Outputs.Snake}
  Plain: {Value: !Ref Plain}
  Zone: {Value: !GetAZs ""}
"""
BUCKET = "models-local-000000000000"


@pytest.fixture
def sandbox(tmp_path, monkeypatch, capsys):
    """Run `racecraft sandbox …` with a home of jobs of its own; return exit code, output and letter."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    (tmp_path / "workshop.yaml").write_text(WORKSHOP)

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["racecraft", "sandbox", *map(str, words)])
        code = 0
        try:
            main()
        except SystemExit as exit_:
            code = exit_.code or 0
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def test_a_workshops_template_becomes_folders_and_outputs(sandbox, tmp_path):
    code, out, _ = sandbox("workshop.yaml")
    desk = tmp_path / "workshop" / "Desk-workshop"
    assert code == 0
    assert list(desk.iterdir()) == []
    assert (tmp_path / "jobs" / "buckets" / BUCKET).is_dir()
    assert f"ModelBucket = {BUCKET}\n" in out
    assert f"Desk = {desk.as_uri()}\n" in out
    for name, kind in (("Net", "EC2::VPC"), ("Config", "SageMaker::NotebookInstanceLifecycleConfig")):
        assert f"ignored  {name} (AWS::{kind}): not here\n" in out
    assert "rests on Net, not here" in out


def test_a_notebook_instance_holds_the_notebooks_that_its_script_fetches_and_we_have(sandbox, tmp_path):
    text = WORKSHOP.replace("drive.ipynb", "rl_deepracer_robomaker_coach.ipynb")
    (tmp_path / "course.yaml").write_text(text)
    _, out, _ = sandbox("course.yaml")
    (notebook,) = (tmp_path / "course" / "Desk-course").iterdir()
    assert notebook.name == "rl_deepracer_robomaker_coach.ipynb"
    assert json.loads(notebook.read_text())["nbformat"] == 4
    assert "(rl_deepracer_robomaker_coach.ipynb)" in out
    (tmp_path / "none.yaml").write_text(text.replace("LifecycleConfigName:", "Other:"))
    sandbox("none.yaml")
    assert list((tmp_path / "none" / "Desk-none").iterdir()) == [], "an instance without the script"


def test_json_tells_all_of_it_and_the_folder_keeps_it(sandbox, tmp_path):
    code, out, _ = sandbox("workshop.yaml", "here", "--parameter", "MakeBucket=False", "--json")
    told = json.loads(out)
    assert code == 0
    assert told == json.loads((tmp_path / "here" / "sandbox.json").read_text())
    assert (told["buckets"], told["parameters"]["MakeBucket"]) == ({}, "false")
    assert [one["name"] for one in told["outputs"]] == ["Role", "Net", "Desk"]
    fates = {one["resource"]: (one["made"], one["why"]) for one in told["resources"]}
    assert fates["Models"] == (None, "condition MakeBucket does not hold")
    assert fates["Desk"] == ("notebook Desk-workshop", "")
    assert told["notebooks"] == {"Desk-workshop": str(tmp_path / "here" / "Desk-workshop")}
    assert not (tmp_path / "jobs" / "buckets").exists()


def test_what_is_not_here_is_listed_and_the_rest_is_made(sandbox, tmp_path):
    (tmp_path / "outer.yaml").write_text(OUTER)
    code, out, _ = sandbox("outer.yaml")
    assert code == 0
    assert "ignored  Api (AWS::CloudFormation::Stack): not here\n" in out
    assert re.search(r"ignored  Odd \(AWS::S3::Bucket\): .*outer\.yaml:\d+: Fn::Select is not here\n", out)
    assert "Plain = outer-plain\n" in out
    assert re.search(r"Zone = nothing here: .*outer\.yaml:\d+: Fn::GetAZs is not here\n", out)
    assert "rests on Api, not here: the name is made up" in out


def test_notebooks_find_the_bucket_and_the_outputs_again(sandbox, tmp_path, capsys):
    sandbox("workshop.yaml", "--stack-name", "desk")
    (tmp_path / "cell.py").write_text(
        "import sagemaker\nfrom racecraft.compat.names import boto3\n"
        "told = boto3.client('cloudformation').describe_stacks(StackName='desk')['Stacks'][0]['Outputs']\n"
        "bucket = {one['OutputKey']: one['OutputValue'] for one in told}['ModelBucket']\n"
        "print(sagemaker.Session().upload_data('cell.py', bucket=bucket, key_prefix='code'))\n"
        "s3 = boto3.client('s3')\n"
        "print([one['Key'] for one in s3.list_objects_v2(Bucket=bucket, Prefix='co')['Contents']])\n"
        "s3.upload_file('cell.py', bucket, 'a/b.py')\n"
        "s3.download_file(bucket, 'a/b.py', 'again.py')\n"
        "print(s3.list_buckets()['Buckets'])\n"
        "for call in (lambda: s3.head_bucket(Bucket='modelz'), lambda: s3.upload_file('cell.py', bucket, '../../x')):\n"
        "    try:\n        call()\n    except Exception as letter:\n        print(letter)\n"
    )
    run_script(tmp_path / "cell.py")
    out = capsys.readouterr().out
    assert f"s3://{BUCKET}/code/cell.py\n['code/cell.py']\n[{{'Name': '{BUCKET}'}}]" in out
    assert (tmp_path / "again.py").read_text() == (tmp_path / "cell.py").read_text()
    assert "s3://modelz: there is no such bucket" in out
    assert "leads out of the bucket" in out
    assert not (tmp_path / "jobs" / "x").exists()


def test_a_bucket_that_stands_keeps_what_is_in_it(sandbox, tmp_path):
    (tmp_path / "jobs" / "buckets" / BUCKET).mkdir(parents=True)
    (tmp_path / "jobs" / "buckets" / BUCKET / "model.tar.gz").write_text("kept")
    _, out, _ = sandbox("workshop.yaml")
    assert "(stood already; kept)" in out
    assert (tmp_path / "jobs" / "buckets" / BUCKET / "model.tar.gz").read_text() == "kept"


@pytest.mark.parametrize(
    ("change", "words", "letter"),
    [
        ((), ["workshop.yaml", "taken"], "taken: stands already"),
        ((), ["workshop.yaml", "--parameter", "Frm=x"], "Did you mean 'From'"),
        ((), ["workshop.yaml", "--stack-name", "../x"], "no name of a stack"),
        (("[Desk, !Ref", "[!Ref Desk, !Ref"), ["workshop.yaml"], "a name that waits for itself"),
        (("[Desk, !Ref", "[../../Desk, !Ref"), ["workshop.yaml"], "at most 63 letters"),
        (("Condition: MakeBucket, V", "V"), ["workshop.yaml", "--parameter", "MakeBucket=false"], "which is not made"),
    ],
)
def test_what_cannot_be_used_is_a_letter_and_nothing_is_made(sandbox, tmp_path, change, words, letter):
    if change:
        assert change[0] in WORKSHOP
        (tmp_path / "workshop.yaml").write_text(WORKSHOP.replace(*change))
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "mine.txt").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    code, out, err = sandbox(*words)
    assert (code, out) == (2, "")
    assert re.search(letter, err)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_stacks_name_is_given_once_while_its_folder_stands(sandbox):
    assert sandbox("workshop.yaml")[0] == 0
    code, _, err = sandbox("workshop.yaml", "another")
    assert code == 2
    assert "stack 'workshop' stands already" in err

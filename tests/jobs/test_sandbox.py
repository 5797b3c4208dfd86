"""`racecraft sandbox`: a template shaped like the workshop's, and one with nested stacks like the snakes'."""

import json
import sys
import zipfile

import pytest

from racecraft.cli.app import main
from racecraft.compat.foreign import run_script
from racecraft.sagemaker.sandbox.fates import reason_for

pytest.importorskip("yaml", reason="pyyaml is not installed")

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
  Api:
    Type: AWS::CloudFormation::Stack
    Properties:
      TemplateURL: !Sub "https://x-${AWS::Region}.s3.amazonaws.com/deep/inner.yaml"
      Parameters: {Tail: bolt}
  Away:
    Type: AWS::CloudFormation::Stack
    Properties: {TemplateURL: "https://elsewhere/away.yaml"}
Outputs:
  Snake: {Value: !GetAtt Api.Outputs.Snake}
  Gone: {Value: !GetAtt Away.Outputs.X}
"""
INNER = """\
Parameters: {Tail: {Type: String}}
Resources:
  Rest: {Type: "AWS::ApiGateway::RestApi"}
Outputs:
  Snake: {Value: !Sub "https://${Rest}.execute-api.${AWS::Region}.amazonaws.com/snake/"}
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
    copies = tmp_path / "copies"
    (copies / "scripts").mkdir(parents=True)
    (copies / "drive.ipynb").write_text("{}")
    with zipfile.ZipFile(copies / "scripts" / "drive.zip", "w") as packed:
        packed.writestr("src/train.py", "print('go')")
    code, out, _ = sandbox("workshop.yaml", "--files", copies)
    desk = tmp_path / "workshop" / "Desk-workshop"
    assert code == 0
    assert (desk / "src" / "train.py").read_text() == "print('go')"
    assert (desk / "drive.ipynb").is_file()
    assert (tmp_path / "jobs" / "buckets" / BUCKET).is_dir()
    assert f"ModelBucket = {BUCKET}\n" in out
    assert f"Desk = {desk.as_uri()}\n" in out
    assert "ignored  Net (AWS::EC2::VPC): a network of the cloud" in out
    assert "rests on Net, not here" in out
    assert "not run  chown -R ec2-user /home/ec2-user/SageMaker" in out
    assert "missing" not in out


def test_json_tells_all_of_it_and_the_folder_keeps_it(sandbox, tmp_path):
    code, out, _ = sandbox("workshop.yaml", "here", "--parameter", "MakeBucket=False", "--json")
    told = json.loads(out)
    assert code == 0
    assert told == json.loads((tmp_path / "here" / "sandbox.json").read_text())
    assert (told["buckets"], told["parameters"]["MakeBucket"]) == ({}, "false")
    assert [one["name"] for one in told["outputs"]] == ["Role", "Net", "Desk"]
    fates = {one["resource"]: (one["made"], one["why"]) for one in told["resources"]}
    assert fates["Models"] == (None, "condition MakeBucket does not hold")
    assert list(told["notebooks"]["Desk-workshop"]["missing"]) == ["drive.ipynb", "drive.zip"]
    assert not (tmp_path / "jobs" / "buckets").exists()


def test_nested_stacks_are_followed_where_they_lie_beside_it(sandbox, tmp_path):
    (tmp_path / "outer.yaml").write_text(OUTER)
    (tmp_path / "inner.yaml").write_text(INNER)
    code, out, _ = sandbox("outer.yaml")
    assert code == 0
    assert "Snake = http://127.0.0.1:8000/\n" in out
    assert "Gone = nothing here: Away's template does not lie beside outer.yaml" in out
    assert "ignored  Api.Rest (AWS::ApiGateway::RestApi)" in out


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
        ((), ["absent.yaml"], "absent.yaml: cannot be read"),
        ((), ["workshop.yaml", "taken"], "taken: stands already"),
        ((), ["workshop.yaml", "--parameter", "Make"], "--parameter Make: no value"),
        ((), ["workshop.yaml", "--parameter", "Frm=x"], "Did you mean 'From'"),
        ((), ["workshop.yaml", "--parameter", "MakeBucket=maybe"], "one of true, false"),
        ((), ["workshop.yaml", "--stack-name", "../x"], "no name of a stack"),
        ((), ["workshop.yaml", "--files", "nowhere"], "there is no such folder"),
        (("[models,", "[Models,"), ["workshop.yaml"], "3 to 63 of a-z"),
        (("[Desk, !Ref", "[../../Desk, !Ref"), ["workshop.yaml"], "at most 63 letters"),
        (("Default: course-files", "Default: {}"), ["workshop.yaml"], "workshop.yaml:4: Parameters.From.Default"),
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
    assert letter in err
    assert sorted(tmp_path.rglob("*")) == before


def test_an_archive_that_leads_out_of_the_folder_is_refused_and_nothing_is_made(sandbox, tmp_path):
    with zipfile.ZipFile(tmp_path / "drive.zip", "w") as packed:
        packed.writestr("../../out.py", "")
    before = sorted(tmp_path.rglob("*"))
    code, _, err = sandbox("workshop.yaml")
    assert code == 2
    assert "leads out of the archive" in err
    assert sorted(tmp_path.rglob("*")) == before


def test_a_stacks_name_is_given_once_while_its_folder_stands(sandbox):
    assert sandbox("workshop.yaml")[0] == 0
    code, _, err = sandbox("workshop.yaml", "another")
    assert code == 2
    assert "stack 'workshop' stands already" in err


def test_every_reason_is_a_clause_and_the_longest_beginning_counts():
    assert reason_for("AWS::EC2::Instance") != reason_for("AWS::EC2::InternetGateway")
    assert reason_for("AWS::S3::BucketPolicy") == reason_for("AWS::IAM::Policy")

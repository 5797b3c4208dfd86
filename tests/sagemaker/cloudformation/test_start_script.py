"""Start-up scripts, line by line: what each command lays, by its manual page, and which lines are left to nobody."""

import pytest

from racecraft.sagemaker.cloudformation.start_script import Fetched, Unpacked, Written, read_start_script

UNDERSTOOD = {
    "curl -o a.zip https://h/x.zip": Fetched("a.zip", "https://h/x.zip"),
    "curl --output d/a.zip https://h/x.zip": Fetched("d/a.zip", "https://h/x.zip"),
    "curl -O https://h/x.zip": Fetched("x.zip", "https://h/x.zip"),
    "curl --remote-name https://h/p/x.zip": Fetched("x.zip", "https://h/p/x.zip"),
    "curl https://h/x.zip -fsSLO --retry 3": Fetched("x.zip", "https://h/x.zip"),
    "sudo curl -O https://h/x.zip": Fetched("x.zip", "https://h/x.zip"),
    "wget https://h/x.zip": Fetched("x.zip", "https://h/x.zip"),
    "wget https://h/folder/?a=b": Fetched("folder", "https://h/folder/?a=b"),
    "wget -O y.zip https://h/x.zip": Fetched("y.zip", "https://h/x.zip"),
    "wget --output-document y.zip https://h/x.zip": Fetched("y.zip", "https://h/x.zip"),
    "aws s3 cp s3://b/k/e.txt f.txt": Fetched("f.txt", "s3://b/k/e.txt"),
    "aws s3 cp s3://b/k/e.txt in/": Fetched("in/e.txt", "s3://b/k/e.txt"),
    "aws s3 cp s3://b/k/e.txt . --quiet --no-progress": Fetched("e.txt", "s3://b/k/e.txt"),
    "aws s3 cp s3://b/k/e.txt . --region eu-west-1": Fetched("e.txt", "s3://b/k/e.txt"),
    "aws s3 cp --recursive s3://b/k/ .": Fetched(".", "s3://b/k/", True),
    "aws s3 cp s3://b/k/ in/ --recursive": Fetched("in", "s3://b/k/", True),
    "aws s3 sync s3://b/k .": Fetched(".", "s3://b/k", True),
    "git clone https://h/o/r.git": Fetched("r", "https://h/o/r.git", True),
    "git clone https://h/o/r in/there": Fetched("in/there", "https://h/o/r", True),
    "git clone git@h:o/r.git": Fetched("r", "git@h:o/r.git", True),
    "git clone --depth 1 -b main https://h/o/r.git": Fetched("r", "https://h/o/r.git", True),
    "git clone --depth 1 https://h/o/r.git in --quiet": Fetched("in", "https://h/o/r.git", True),
    "unzip a.zip": Unpacked("a.zip", "."),
    "unzip -o -q in/a.zip": Unpacked("in/a.zip", "."),
    "unzip a.zip -d in/there": Unpacked("a.zip", "in/there"),
    "unzip -d in a.zip": Unpacked("a.zip", "in"),
    "touch a": Written("a", "", True),
    "echo a b  c > f": Written("f", "a b c\n", False),
    "echo 'a  b' >> f": Written("f", "a  b\n", True),
    "echo > f": Written("f", "\n", False),
    "echo '' > f": Written("f", "\n", False),
}

LEFT = [
    "curl https://h/x.zip",  # to the screen
    "curl --silent https://h/x.zip",
    "curl --OK https://h/x.zip",
    "curl -O https://h/x.zip https://h/y.zip",
    "curl -o a -o b https://h/x.zip",
    "curl -O x.zip",
    "curl -o '' https://h/x.zip",
    "curl -o /etc/x https://h/x.zip",
    "curl -o ~/x https://h/x.zip",
    "curl -O https://h/$NAME.zip",
    "curl -o in/x https://h/$NAME.zip",
    "wget -O ../x.zip https://h/x.zip",
    "aws s3 cp s3://b/k/e.txt",
    "aws s3 mv s3://b/k/e.txt .",
    "aws s3api cp s3://b/k/e.txt .",
    "aws s3 cp model.zip s3://b/k/",  # brings something away
    "aws s3 sync in s3://b/k/",
    "aws s3 cp s3://b/$KEY .",
    "git clone",
    "git pull https://h/o/r.git",
    "git clone https://h/o/r.git in there",
    "git clone $WHERE",
    "unzip",
    "unzip a.zip b.txt",
    "unzip /tmp/a.zip",
    "unzip a.zip -d /tmp",
    "touch",
    "touch a /etc/b",
    "touch a*",
    "touch a?",
    "touch `b`",
    "touch $HOME/b",
    "echo a",
    "echo",
    "echo a b",
    "echo -n a > f",
    "echo a > /etc/f",
    "echo a >> ../f",
    "cd",
    "cd a b",
    "cd /tmp",
    "cd ..",
    "cd ~",
    "touch a; touch b",
    "touch a && touch b",
    "echo a | touch b",
    "touch a&",
    "touch 'a",  # a quote that is not closed
    "sudo pip install x",
    "set -e",
]


@pytest.mark.parametrize("line", UNDERSTOOD)
def test_a_command_that_brings_something_is_understood(line):
    script = read_start_script(line)
    assert script.acts == [UNDERSTOOD[line]]
    assert script.left == []
    if isinstance(script.acts[0], Fetched):
        assert script.acts[0].is_folder == any(word in line for word in ("--recursive", "sync", "clone"))


@pytest.mark.parametrize("line", LEFT)
def test_a_line_of_which_anything_is_not_understood_is_left_whole(line):
    script = read_start_script(f"{line}\ntouch here")
    assert script.left == [line]
    assert script.acts == [Written("here", "", True)], "nothing of it is done, and nobody went anywhere"


@pytest.mark.parametrize("home", ["/home/ec2-user/SageMaker", "~/SageMaker", "$HOME/SageMaker", "SageMaker"])
def test_the_notebooks_folder_has_four_names_wherever_one_stands(home):
    script = read_start_script(f"cd {home}\ntouch a\ncd in/there\ntouch b ../c\ntouch {home}/d\ncd {home}/\ntouch e")
    assert [act.path for act in script.acts] == ["a", "in/there/b", "in/c", "d", "e"]
    assert script.left == []


def test_another_folder_whose_name_begins_so_is_not_the_notebooks():
    assert read_start_script("touch SageMakerOld/a").acts == [Written("SageMakerOld/a", "", True)]
    assert read_start_script("touch ~/SageMakerOld/a").left == ["touch ~/SageMakerOld/a"]


def test_one_touch_makes_several_files_in_their_order():
    assert [act.path for act in read_start_script("touch b a c/d").acts] == ["b", "a", "c/d"]


def test_what_ends_a_text_within_a_script_is_no_command_and_only_once():
    script = read_start_script("x <<A\ny <<-'B'\ntouch b\nB\ntouch a\nA\nA\nB\n")
    assert script.acts == [Written("b", "", True), Written("a", "", True)]
    assert script.left == ["x <<A", "y <<-'B'", "A", "B"]


def test_empty_lines_and_remarks_are_not_told_and_a_line_goes_on_behind_a_backslash():
    script = read_start_script("\n  \n# a remark\n   # another\n  touch \\\n   a  # a third\nsudo\n")
    assert script.acts == [Written("a", "", True)]
    assert script.left == []

"""Job files: what stands in one, what each field may hold, at its borders."""

import json
from pathlib import Path

import pytest

from racecraft.formats.job_spec import (
    JobNameError,
    JobSpec,
    JobSpecError,
    read_job_spec,
    require_legal_name,
    write_job_spec,
)

COMMAND = ["gym", "train", "CartPole-v1"]


def read(tmp_path, told):
    path = tmp_path / "job.json"
    path.write_text(told if isinstance(told, str) else json.dumps(told, indent=1))
    return read_job_spec(path)


def test_a_job_of_nothing_but_a_command_has_these_defaults(tmp_path):
    spec = read(tmp_path, {"command": COMMAND})
    assert spec == JobSpec(tuple(COMMAND))
    assert spec.as_dictionary() == {
        "command": COMMAND, "name": "", "resume": [], "run": "", "older_run": "", "folder": ".", "environment": {},
        "python": "", "cores": None, "memory_mib": 1024, "max_run_seconds": None, "use_spot_instances": False,
        "max_wait_seconds": None, "metric_definitions": [], "recorded": {},
    }  # fmt: skip
    assert spec.run_folder() is None


def test_what_is_written_comes_back_and_says_what_it_is(tmp_path):
    spec = JobSpec(
        tuple(COMMAND), "n-1", ("gym", "--resume"), "runs/a", "mark", "/home/me", {"A": "b"}, "/bin/python", 2, 512, 60,
        True, 90, ({"Name": "score", "Regex": "score=(.*)"},), {"by": ["me"]},
    )  # fmt: skip
    write_job_spec(tmp_path / "job.json", spec)
    assert read_job_spec(tmp_path / "job.json") == spec
    assert spec.run_folder() == Path("/home/me/runs/a")
    text = (tmp_path / "job.json").read_text()
    assert text.startswith('{\n  "format": "racecraft job",\n  "version": 1,\n  "command": [\n    "gym",')
    assert text.endswith("}\n")


TAKEN = [
    {"cores": 0}, {"cores": None}, {"memory_mib": 0}, {"max_run_seconds": 1}, {"name": ""},
    *({"command": [word]} for word in ("train", "gym", "snakes", "unity", "run", "serve", "dr", "jobs")),
]  # fmt: skip


@pytest.mark.parametrize("told", TAKEN, ids=json.dumps)
def test_what_a_field_may_just_hold_is_taken(tmp_path, told):
    spec = read(tmp_path, {"command": COMMAND, **told}).as_dictionary()
    assert {name: value for name, value in spec.items() if name in told} == {
        name: value for name, value in told.items() if name not in ("format", "version")
    }


SECONDS = "a whole number of seconds above 0, or null"
REFUSED = [
    ({"cores": -1}, r"cores: -1; expected a whole number, or null for all"),
    ({"cores": True}, "cores: True; expected a whole number"),
    ({"memory_mib": -1}, "memory_mib: -1; expected"),
    ({"max_run_seconds": 0}, f"max_run_seconds: 0; expected {SECONDS}"),
    ({"max_wait_seconds": 0}, f"max_wait_seconds: 0; expected {SECONDS}"),
    ({"use_spot_instances": 1}, "use_spot_instances: 1; expected true or false"),
    ({"command": []}, r"command: \[\]; expected a list of words behind `racecraft`, the first of run, serve"),
    ({"command": ["rm", "-r"]}, r"command: \['rm', '-r'\]; expected a list of words"),
    ({"resume": [1]}, r"resume: \[1\]; expected a list of words"),
    ({"environment": {"a": 1}}, r"environment: \{'a': 1\}; expected an object of texts"),
    ({"metric_definitions": [{"Name": "a"}]}, "metric_definitions: .* expected a list of"),
    ({"metric_definitions": [{"Name": "a", "Regex": 1}]}, "metric_definitions: .* expected a list of"),
    ({"recorded": []}, r"recorded: \[\]; expected an object"),
    ({"name": 1}, "name: 1; expected a word"),
    ({"name": "a" * 64}, "name: 'a*'; expected .* is no name of a job"),
    ({"run": None}, "run: None; expected a folder"),
    ({"older_run": 1}, "older_run: 1; expected the mark of a run"),
    ({"python": 1}, "python: 1; expected the path of an interpreter"),
    ({"comand": 1}, "comand: an unknown field; .*Did you mean 'command'"),
    ({"format": "other"}, "format: 'other'; expected 'racecraft job'"),
    ({"version": 2}, "version: 2; expected 1. A newer racecraft wrote it: upgrade"),
]


@pytest.mark.parametrize(("told", "letter"), REFUSED)
def test_what_a_field_may_not_hold_is_refused_by_its_name_and_line(tmp_path, told, letter):
    with pytest.raises(JobSpecError, match=rf"job\.json:\d+: {letter}"):
        read(tmp_path, {"command": COMMAND, **told})


def test_a_file_without_a_command_is_no_job(tmp_path):
    with pytest.raises(JobSpecError, match='no "command"; expected one, such as'):
        read(tmp_path, {"name": "a"})
    with pytest.raises(JobSpecError, match='a list; expected an object with "command"'):
        read(tmp_path, "[]")
    with pytest.raises(JobSpecError, match="expected a JSON object with a command"):
        read(tmp_path, "{")


def test_names_are_letters_digits_and_hyphens_between():
    for name in ("a", "7", "a-b", "A--9", "a" * 63):
        assert require_legal_name(name) == name
    for name in ("", "-", "a-", "-a", "a_b", "ä", "a b", "a\n", "a" * 64):
        with pytest.raises(JobNameError):
            require_legal_name(name)

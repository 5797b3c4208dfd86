"""The public part of ML-Agents' own test suite passes under our names, where somebody has it unpacked.

RACECRAFT_MLAGENTS_REPOSITORY   a copy of Unity-Technologies/ml-agents (release 21 or 22), or its ml-agents-envs folder

Nothing of it is copied here. The tests named below are left out because they hold ML-Agents to its internals (messages
compiled from its own files, a communicator in place of a player, underscored methods); the rest are its users' view.
"""

import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import pytest

import racecraft

REPOSITORY = os.environ.get("RACECRAFT_MLAGENTS_REPOSITORY")
pytestmark = [
    pytest.mark.skipif(not REPOSITORY, reason="RACECRAFT_MLAGENTS_REPOSITORY names no copy of ml-agents"),
    pytest.mark.skipif(sys.platform == "win32", reason="a script is no program on Windows"),
]

INTERNAL = {
    "test_envs.py": (
        "test_handles_bad_filename", "test_initialization", "test_port_defaults", "test_log_file_path_is_set",
        "test_reset", "test_step", "test_close", "test_check_communication_compatibility",
        "test_returncode_to_signal_name",
    ),
    "test_rpc_communicator.py": (
        "test_rpc_communicator_checks_port_on_create", "test_rpc_communicator_close",
        "test_rpc_communicator_create_multiple_workers", "test_rpc_communicator_initialize_OK",
        "test_rpc_communicator_initialize_timeout", "test_rpc_communicator_initialize_callback",
    ),
    "test_rpc_utils.py": (
        "test_process_pixels", "test_process_pixels_multi_png", "test_process_pixels_gray", "test_vector_observation",
        "test_process_visual_observation", "test_process_visual_observation_grayscale",
        "test_process_visual_observation_padded_channels", "test_process_visual_observation_bad_shape",
        "test_batched_step_result_from_proto", "test_mismatch_observations_raise_in_step_result_from_proto",
        "test_action_masking_discrete", "test_action_masking_discrete_1", "test_action_masking_discrete_2",
        "test_action_masking_continuous", "test_agent_behavior_spec_from_proto",
        "test_batched_step_result_from_proto_raises_on_infinite", "test_batched_step_result_from_proto_raises_on_nan",
    ),
}  # fmt: skip
"""Tests of internals, by file. Nothing else stands in these files, so that they need not even load."""
PUBLIC = 39
"""How many of the 73 tests of releases 21 and 22 are left, with `test_timers`, which patches one internal."""


def suite():
    folder = Path(REPOSITORY).expanduser()
    tests = folder / "tests" if folder.name == "ml-agents-envs" else folder / "ml-agents-envs" / "tests"
    assert tests.is_dir(), f"{tests}: no tests stand there; expected an unpacked copy of ml-agents"
    return tests


def names_in(path):
    return set(re.findall(r"^def (test_\w+)", path.read_text(), re.MULTILINE))


def manifest(folder):
    """Write a manifest whose scenes are our stand-ins, as zips of one program each."""
    home, here = Path(racecraft.__file__).parent.parent, Path(__file__).parent
    lines = ["environments:"]
    for scene, module in (("Basic", "racecraft.worlds.unity.env.basic_scene"), ("3DBall", "ball_scene")):
        program = f'#!/bin/sh\nPYTHONPATH="{home}:{here}" exec "{sys.executable}" -P -m {module} "$@"\n'
        archive = folder / f"{scene}.zip"
        with zipfile.ZipFile(archive, "w") as zipped:
            zipped.writestr(f"{scene}/{scene}.x86_64", program)
        address = archive.as_uri()
        lines.append(f"  - {scene}: {{linux_url: '{address}', darwin_url: '{address}', win_url: '{address}'}}")
    path = folder / "manifest.yaml"
    path.write_text("\n".join(lines))
    return path


def test_the_public_part_of_the_official_suite_passes_under_our_names(tmp_path):
    pytest.importorskip("pettingzoo", reason="four of its tests are PettingZoo's own")
    tests, report, empty = suite(), tmp_path / "report.xml", tmp_path / "empty.ini"
    empty.write_text("[pytest]\n")
    files = [path for path in sorted(tests.glob("test_*.py")) if names_in(path) - set(INTERNAL.get(path.name, ()))]
    left_out = [f"--deselect={file}::{name}" for file, names in INTERNAL.items() for name in names]
    home = Path(racecraft.__file__).parent.parent
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "official_suite", "-p", "no:cacheprovider", "-c", empty,
         "--rootdir", tests, "--basetemp", tmp_path / "t", f"--junitxml={report}", *left_out, *files],
        capture_output=True,
        text=True,
        timeout=300,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(home), str(Path(__file__).parent)]),
            "PYTHONDONTWRITEBYTECODE": "1",
            "RACECRAFT_UNITY_MANIFEST": str(manifest(tmp_path)),
            "TMPDIR": str(tmp_path),
            "https_proxy": "http://127.0.0.1:9",  # nobody is there: what it would download is played by stand-ins
        },
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout[-4000:]
    told = ElementTree.parse(report).getroot().find("testsuite").attrib
    assert (told["failures"], told["errors"], told["skipped"]) == ("0", "0", "0")
    assert int(told["tests"]) >= PUBLIC

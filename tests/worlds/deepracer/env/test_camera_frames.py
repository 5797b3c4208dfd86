"""Our frames beside the original's: the pose of each was not recorded and is fitted first."""

import importlib.util
import sys
from pathlib import Path

import pytest
from tests.reference import DATA, HAS_ALL, LARGE

HOME = Path(__file__).resolve().parents[4]
FRAMES = DATA / "frames"


@pytest.fixture(scope="module")
def compare_frames():
    spec = importlib.util.spec_from_file_location("compare_frames", HOME / "scripts" / "compare_frames.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_frames_of_the_original_are_met(compare_frames):
    frames = compare_frames.read_frames(FRAMES)[[12, 20, 64, 76] if HAS_ALL else slice(None)]
    found = compare_frames.compare(frames)
    assert found.agrees().all(), (found.edge_px, found.grey)


@pytest.mark.skipif(not HAS_ALL, reason=LARGE)
@pytest.mark.long
def test_eighty_of_the_originals_92_frames_are_met(compare_frames):
    found = compare_frames.compare(compare_frames.read_frames(FRAMES))
    assert found.agrees().sum() >= 80

"""Files that settings name are copied into the run, and read from there."""

from pathlib import Path

import pytest

from racecraft.algorithms.behaviour_cloning import BcConfig
from racecraft.formats.run_folder import RunFolder
from racecraft.rollout.settings import RolloutConfig
from racecraft.settings.composition import Settings
from racecraft.training.named_files import as_in_run, found_in_run, lay_named_files, named_files, overrides_in_run


@pytest.fixture
def shown(tmp_path):
    path = tmp_path / "mine" / "demos.safetensors"
    path.parent.mkdir()
    path.write_bytes(b"shown")
    return path


def settings_of(path):
    return Settings(rollout=RolloutConfig(), bc=BcConfig(demonstrations=str(path), batch_size=7))


def test_a_copy_travels_and_is_named(shown, tmp_path):
    settings = settings_of(shown)
    run = RunFolder.create(tmp_path / "run", {}, lambda run: lay_named_files(named_files(settings), run))
    told = as_in_run(settings)
    assert told.bc == BcConfig(demonstrations="bc-demonstrations.safetensors", batch_size=7)
    assert told.rollout == settings.rollout
    shown.unlink()
    moved = RunFolder.open(run.path.rename(tmp_path / "mailed"))
    for said in (told, settings):  # cars begin again from what was typed
        assert Path(found_in_run(said, moved).bc.demonstrations).read_bytes() == b"shown"


def test_a_folder_of_unitys_demonstrations_travels_too(tmp_path):
    mine = tmp_path / "played.today"
    mine.mkdir()
    for name in ("a.demo", "b.demo", "notes.txt"):
        (mine / name).write_text(name)
    settings = settings_of(mine)
    run = RunFolder.create(tmp_path / "run", {}, lambda run: lay_named_files(named_files(settings), run))
    for said in (as_in_run(settings), settings):
        found = Path(found_in_run(said, run).bc.demonstrations)
        assert found.parent == run.path
        assert [(one.name, one.read_text()) for one in sorted(found.iterdir())] == [
            (name,) * 2 for name in ("a.demo", "b.demo")
        ]


def test_what_was_typed_names_the_copy_too(shown):
    typed = [f"bc.demonstrations={shown}", "bc.batch_size=7"]
    assert overrides_in_run(typed, settings_of(shown)) == [
        "bc.demonstrations=bc-demonstrations.safetensors",
        "bc.batch_size=7",
    ]


def test_what_is_no_file_stays_as_it_is(tmp_path):
    run = RunFolder.create(tmp_path / "run", {})
    for settings in (settings_of(tmp_path / "absent"), settings_of(tmp_path), Settings(rollout=RolloutConfig())):
        assert named_files(settings) == {}
        assert as_in_run(settings) == settings
        assert found_in_run(settings, run) == settings


def test_each_learner_of_a_run_has_a_copy_of_its_own(tmp_path):
    run = RunFolder.create(tmp_path / "run", {})
    told = {}
    for name in ("", "Goalie"):
        shown = tmp_path / f"{name}.demo"
        shown.write_text(f"of {name}")
        lay_named_files(named_files(settings_of(shown), of=name), run)
        told[name] = as_in_run(settings_of(shown), of=name)
        shown.unlink()
    assert told["Goalie"].bc.demonstrations == "Goalie-bc-demonstrations.demo"
    for name, settings in told.items():
        assert Path(found_in_run(settings, run, of=name).bc.demonstrations).read_text() == f"of {name}"

"""A model is copied while its training goes on: what is just being written or taken away does no harm."""

import json
import shutil

import numpy as np
import pytest

from racecraft.contract.errors import RunFolderError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.files import model_copy


def trained(folder):
    run = RunFolder.create(folder, {"kind": "deepracer"})
    for name in ("metrics.jsonl", "metrics.jsonl.part", "run.lock", "old.safetensors"):
        (run.path / name).touch()
    return run


def test_what_is_just_being_written_stays_behind(tmp_path):
    source, copy = trained(tmp_path / "a"), tmp_path / "b"
    model_copy.copy_model(source, copy)
    assert (copy / "metrics.jsonl").exists()
    assert not list(copy.rglob("*.part"))
    assert not (copy / "run.lock").exists()


def test_what_a_link_leads_to_comes_along(tmp_path):
    """A copy that is e-mailed evaluates: nothing in it leads back to this machine."""
    source, weights = trained(tmp_path / "a"), tmp_path / "elsewhere"
    weights.write_text("weights")
    (source.path / "linked").symlink_to(weights)
    model_copy.copy_model(source, tmp_path / "b")
    assert not (tmp_path / "b" / "linked").is_symlink()
    assert (tmp_path / "b" / "linked").read_text() == "weights"


def test_what_is_taken_away_meanwhile_is_not_missed(tmp_path, monkeypatch):
    source, passed_over = trained(tmp_path / "a"), model_copy._passed_over

    def after_a_moment(*given):
        stays_behind = passed_over(*given)

        def passed(folder, names):
            (source.path / "old.safetensors").unlink(missing_ok=True)
            return stays_behind(folder, names)

        return passed

    monkeypatch.setattr(model_copy, "_passed_over", after_a_moment)
    model_copy.copy_model(source, tmp_path / "b")
    assert (tmp_path / "b" / "job.json").exists()
    assert not (tmp_path / "b" / "old.safetensors").exists()


def test_what_cannot_be_copied_at_all_is_a_letter_and_leaves_nothing(tmp_path, monkeypatch):
    source = trained(tmp_path / "a")
    tried = []

    def fails(*given, **more):
        tried.append(given)
        (tmp_path / given[1]).mkdir()
        raise shutil.Error([("a", "b", "why")])

    monkeypatch.setattr(shutil, "copytree", fails)
    with pytest.raises(RunFolderError, match="cannot be written"):
        model_copy.copy_model(source, tmp_path / "b")
    assert len(tried) == 3
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_models_folder_is_wiped_and_nothing_else_is(tmp_path):
    """What is a file or a link is somebody's, and stays; where nothing is, there is nothing to do."""
    run = trained(tmp_path / "a")
    (run.path / "run.lock").unlink()
    model_copy.wipe_model(tmp_path / "nowhere")
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("mine")
    link.symlink_to(run.path)
    for other in (file, link):
        with pytest.raises(RunFolderError, match="is no folder; expected the folder of a model"):
            model_copy.wipe_model(other)
    assert run.path.is_dir()
    assert file.read_text() == "mine"
    model_copy.wipe_model(run.path)
    assert not run.path.exists()


def test_a_copy_holds_every_checkpoint_or_the_one_that_was_chosen(tmp_path):
    source = trained(tmp_path / "a")
    for iteration in (1, 2, 3):
        Checkpoints(source.checkpoints).save(iteration, iteration, {"w": np.ones(2)}, {}, score=float(iteration == 2))
    for which, kept in ((None, [1, 2, 3]), ("2", [2]), ("last", [3])):
        model_copy.copy_model(source, tmp_path / f"copy {which}", which)
        shelf = Checkpoints(tmp_path / f"copy {which}" / "checkpoints")
        assert [entry.iteration for entry in shelf.entries()] == kept
        assert [shelf.load_policy(str(one))[0]["w"].sum() for one in kept] == [2.0] * len(kept)


def test_a_copy_goes_where_nothing_or_an_empty_folder_is_however_deep(tmp_path):
    source = trained(tmp_path / "a")
    (tmp_path / "empty").mkdir()
    for target in (tmp_path / "empty", tmp_path / "far" / "away" / "b"):
        assert model_copy.copy_model(source, target) is None
        assert (target / "job.json").exists()
        assert [path.name for path in target.parent.iterdir() if path.name.startswith(".copying")] == []


def test_a_place_that_holds_anything_is_not_copied_to(tmp_path):
    source = trained(tmp_path / "a")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    (tmp_path / "nothing").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "nothing")
    for name, words in (("full", "holds files already"), ("file", "is no folder"), ("link", "is no folder")):
        with pytest.raises(RunFolderError, match=f"{name}: {words}; expected a"):
            model_copy.copy_model(source, tmp_path / name)
    assert (tmp_path / "full" / "mine.txt").read_text() == (tmp_path / "file").read_text() == "mine"
    assert list((tmp_path / "nothing").iterdir()) == []


def test_a_folder_in_which_somebody_trains_is_not_wiped(tmp_path):
    run = trained(tmp_path / "a")
    with run.lock(), pytest.raises(RunFolderError, match="another training holds it"):
        model_copy.wipe_model(run.path)
    assert (run.path / "job.json").exists()
    (run.path / "run.lock").touch()
    model_copy.wipe_model(run.path)
    assert not run.path.exists(), "a lock that nobody holds is no hindrance"


def test_of_a_chosen_checkpoint_the_weights_go_along_and_the_index_says_so(tmp_path):
    source = trained(tmp_path / "a")
    (source.path / "stop").touch()
    for iteration in (1, 2):
        Checkpoints(source.checkpoints).save(iteration, 10 * iteration, {"w": np.ones(2)}, {}, score=0.5)
    (source.path / "stop").with_name("kept.txt").touch()
    chosen = model_copy.copy_model(source, tmp_path / "b", "1")
    assert (chosen.iteration, chosen.steps) == (1, 10)
    assert not (tmp_path / "b" / "stop").exists()
    assert (tmp_path / "b" / "kept.txt").exists()
    folder = tmp_path / "b" / "checkpoints"
    index = next(path for path in folder.iterdir() if path.suffix == ".json")
    assert {path.name for path in folder.iterdir()} == {chosen.policy, index.name}
    told = json.loads(index.read_text())
    (entry,) = told["checkpoints"]
    assert (told["best"], told["last"]) == (1, 1)
    assert entry == {"iteration": 1, "steps": 10, "score": 0.5, "policy": chosen.policy, "state": None}

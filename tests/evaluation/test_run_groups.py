"""Runs as groups of seeds, by what their folders say."""

import pytest

from racecraft.contract.errors import SettingError
from racecraft.evaluation.run_groups import differences, group_runs
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.run_group import RunGroup


def made(path, seed, rate=1e-3, reward="", track="Oval_track"):
    """Make a run folder that was asked for so."""
    settings = {"ppo": {"learning_rate": rate}, "runtime": {"threads": seed}}
    asked = {"asked": {"stops": ["steps=1000"]}, "track": {"name": track}, "settings": settings}
    job = {"kind": "deepracer", "algorithm": "ppo", "seed": seed, "started": seed, **asked}
    run = RunFolder.create(path, job)
    run.reward_function.write_text(reward)
    return str(path)


def test_runs_that_differ_in_seed_and_threads_alone_are_one_group(tmp_path):
    paths = [
        made(tmp_path / f"{name}-{seed}", seed, rate) for name, rate in (("a", 1e-3), ("b", 1e-4)) for seed in (1, 2)
    ]
    groups = group_runs(paths)
    assert [group.name for group in groups] == ["a-1, a-2", "b-1, b-2"]
    assert [(one.name, one.values) for one in differences(groups)] == [("ppo.learning_rate", (1e-3, 1e-4))]
    assert group_runs([made(tmp_path / "models/fast-car/runs/2", 1)])[0].name == "fast-car/2"


def test_a_reward_and_a_checkpoint_are_settings_too(tmp_path):
    plain = made(tmp_path / "a", 1)
    other = made(tmp_path / "b", 1, reward="def reward_function(params): return 1.0")
    assert [one.name for one in differences(group_runs([plain, other]))] == ["reward function"]
    assert [one.name for one in differences(group_runs([plain, f"{plain}:last"]))] == ["checkpoint"]


def test_the_folder_of_train_seeds_is_a_group_whatever_is_in_it(tmp_path):
    group = RunGroup(tmp_path / "three", ("train",), (4, 5, 6))
    group.write()
    for seed in (4, 5):
        made(group.run_of(seed), seed)
    (found,) = group_runs([str(tmp_path / "three")])
    assert (found.name, [one.name for one in found.runs]) == ("three", ["seed-4", "seed-5"])
    assert RunGroup.open(tmp_path / "three") == group


def test_what_cannot_be_compared_is_refused(tmp_path):
    one, other = made(tmp_path / "a", 1), made(tmp_path / "b", 1, track="Monaco")
    with pytest.raises(SettingError, match="named twice"):
        group_runs([one, one])
    with pytest.raises(SettingError, match=r"differ in their track \(Monaco, Oval_track\)"):
        group_runs([one, other])
    RunGroup(tmp_path / "none", ("train",), (1, 2)).write()
    with pytest.raises(SettingError, match="none of its seeds has begun"):
        group_runs([str(tmp_path / "none")])

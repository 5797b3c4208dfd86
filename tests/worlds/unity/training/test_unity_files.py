"""What a Unity training reads is copied into its run, behavior by behavior."""

from dataclasses import replace
from types import SimpleNamespace

from racecraft.algorithms.registry import find_algorithm
from racecraft.formats.run_folder import RunFolder
from racecraft.training.named_files import found_in_run
from racecraft.worlds.unity.training.plan import defaults_for
from racecraft.worlds.unity.training.resolve_settings import ResolvedSettings, own_groups, whose
from racecraft.worlds.unity.training.trainer import _copy_files


def test_the_demonstrations_of_every_behavior_travel(tmp_path):
    ppo, each = find_algorithm("ppo"), {}
    defaults = defaults_for("builtin:Basic", ppo)
    for base in ("Striker", "Goalie 1"):
        shown = tmp_path / f"{base}.demo"
        shown.write_text(base)
        each[base] = defaults.with_group("gail", replace(defaults.gail, demonstrations=str(shown)))
    settled = ResolvedSettings(each, ())
    planned = SimpleNamespace(request=SimpleNamespace(config=None))
    run = RunFolder.create(tmp_path / "run", {}, lambda run: _copy_files(planned, settled, run))
    told = {base: groups["gail"]["demonstrations"] for base, groups in own_groups(settled, ppo).items()}
    assert told == {"Striker": "gail-demonstrations.demo", "Goalie 1": "Goalie-1-gail-demonstrations.demo"}
    again = found_in_run(each["Goalie 1"], run, of=whose(1, "Goalie 1")).gail.demonstrations
    assert again == str(run.path / told["Goalie 1"])
    assert (run.path / told["Goalie 1"]).read_text() == "Goalie 1"
    assert not (run.path / told["Striker"]).exists()  # the training itself lays that one

"""Archives and runs that were made to do harm: each is refused by name, and nothing outside its folder is touched."""

import io
import json
import pickle
import shutil
import tarfile
import zipfile

import pytest
from tests.worlds.deepracer.league.test_club_evening import SHORT, run  # noqa: F401

import racecraft as rc
from racecraft.contract.errors import UserInputError
from racecraft.formats.checkpoint import Checkpoints


class Bomb:
    def __reduce__(self):
        return exec, ("open('/tmp/racecraft-was-here', 'w')",)


def tarred(*members):
    """Return the bytes of a .tar.gz of (name, data, type, link) members."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz") as tar:
        for name, data, kind, link in members:
            entry = tarfile.TarInfo(name)
            entry.size, entry.type, entry.linkname = len(data), kind, link
            tar.addfile(entry, io.BytesIO(data))
    return out.getvalue()


def plain(name, data=b"x"):
    return name, data, tarfile.REGTYPE, ""


def zipped(*members):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return out.getvalue()


JOB = json.dumps({"format": "racecraft run", "version": 1, "kind": "deepracer"}).encode()
ARCHIVES = {
    "leads up": lambda: tarred(plain("../../job.json", JOB)),
    "leads up in the middle": lambda: tarred(plain("a/../../../b.pb")),
    "absolute": lambda: tarred(plain("/etc/cron.d/job.json", JOB)),
    "a drive of Windows": lambda: tarred(plain("C:\\job.json", JOB)),
    "backslashes": lambda: tarred(plain("..\\..\\job.json", JOB)),
    "a link out": lambda: tarred(("model.pb", b"", tarfile.SYMTYPE, "/etc/passwd")),
    "a link to a folder": lambda: tarred(("job.json", b"", tarfile.SYMTYPE, "/etc"), plain("job.json/shadow")),
    "a hard link": lambda: tarred(("job.json", b"", tarfile.LNKTYPE, "/etc/passwd")),
    "a device": lambda: tarred(("model.pb", b"", tarfile.CHRTYPE, "")),
    "a pipe": lambda: tarred(("job.json", b"", tarfile.FIFOTYPE, "")),
    "two run folders": lambda: tarred(plain("a/job.json", JOB), plain("b/job.json", JOB)),
    "nothing of a model": lambda: tarred(plain("readme.txt")),
    "an empty archive": lambda: tarred(),
    "cut off": lambda: tarred(plain("job.json", JOB))[:60],
    "a zip that leads up": lambda: zipped(("../../job.json", JOB)),
    "a zip that fills a disk": lambda: zipped(("model.pb", b"0" * 300_000_000)),
    "no archive": lambda: b"#!/bin/sh\ntouch /tmp/racecraft-was-here\n",
    "a pickle": lambda: pickle.dumps(Bomb()),
    "a pickle as graph": lambda: tarred(
        plain("agent/model.pb", pickle.dumps(Bomb())), plain("model_metadata.json", b"{}")
    ),
    "metadata without end": lambda: tarred(plain("agent/model.pb"), plain("model_metadata.json", b"[" * 100_000)),
    "metadata of megabytes": lambda: tarred(plain("agent/model.pb"), plain("model_metadata.json", b" " * 2_000_000)),
    "a job without checkpoints": lambda: tarred(plain("run/job.json", JOB)),
    "a job that is no JSON": lambda: tarred(plain("run/job.json", b"{")),
    "a job of another world": lambda: tarred(plain("run/job.json", JOB.replace(b"deepracer", b"battlesnake"))),
    "a job of an unknown world": lambda: tarred(plain("run/job.json", JOB.replace(b"deepracer", b"os"))),
}


def entries(league):
    return [path for path in (league / "races/club").rglob("*") if path.is_file() and path.name != "race.json"]


@pytest.fixture
def league(tmp_path):
    rc.create_race("Club", league=tmp_path / "deep/league", **SHORT)
    return tmp_path / "deep/league"


@pytest.mark.parametrize("case", ARCHIVES)
def test_an_archive_that_was_made_to_do_harm_is_refused(league, tmp_path, case):
    (tmp_path / "entry.tar.gz").write_bytes(ARCHIVES[case]())
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(UserInputError):
        rc.enter_race("club", tmp_path / "entry.tar.gz", league=league)
    assert sorted(tmp_path.rglob("*")) == before
    assert entries(league) == []


def change_card(source, place, change):
    """Return a copy of a run whose checkpoint says something else of itself."""
    shutil.copytree(source, place)
    weights, card = Checkpoints(place / "checkpoints").load_policy("best")
    card = json.loads(json.dumps(card))
    change(card)
    shutil.rmtree(place / "checkpoints")
    (place / "checkpoints").mkdir()
    Checkpoints(place / "checkpoints").save(1, 64, dict(weights), card, best=True)
    return place


CARDS = {
    "an algorithm": lambda card: card["policy_spec"].update(algorithm="stolen:Learner"),
    "an encoder": lambda card: card["policy_spec"]["network"].update(encoder="stolen:Encoder"),
    "a policy": lambda card: card["policy_spec"]["network"].update(policy="os:system"),
    "a member": lambda card: card["policy_spec"].update(
        policies={"0": {**card["policy_spec"], "algorithm": "stolen:Learner"}}
    ),
    "no spec": lambda card: card.pop("policy_spec"),
    "a spec of the future": lambda card: card["policy_spec"].update(version=99),
    "an ideal car": lambda card: card["settings"]["race"].update(car="kinematic"),
}


@pytest.mark.parametrize("case", CARDS)
def test_a_checkpoint_that_names_code_or_cheats_is_refused(run, league, tmp_path, case, monkeypatch):  # noqa: F811
    (tmp_path / "stolen.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    monkeypatch.chdir(tmp_path)
    place = change_card(run, tmp_path / "car", CARDS[case])
    (place / "code").mkdir(exist_ok=True)
    shutil.copy(tmp_path / "stolen.py", place / "code")
    with pytest.raises(UserInputError):
        rc.enter_race("club", place, league=league)
    assert not (tmp_path / "ran").exists()
    assert entries(league) == []


def test_a_race_drives_by_its_own_rules_whatever_the_car_was_trained_with(run, league, tmp_path):  # noqa: F811
    from racecraft.worlds.deepracer.league.drives import in_race
    from racecraft.worlds.deepracer.league.rules import CarRules
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car

    def change(card):
        card["settings"]["race"].update(max_episode_seconds=99999.0, fidelity="aws", reverse=True, waypoints="distinct")

    rc.enter_race("club", change_card(run, tmp_path / "car", change), league=league)
    car = in_race(load_trained_car(league / "races/club/entries/00001/model"), CarRules(laps=1))
    race = car.settings.race
    assert (race.max_episode_seconds, race.fidelity, race.reverse, race.waypoints) == (None, "sane", False, "as_filed")

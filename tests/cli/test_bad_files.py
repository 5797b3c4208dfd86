"""Files that are damaged, foreign, of another version or half-written: a letter each, with file and line."""

import shutil

import numpy as np
import pytest
from tests.cli.conftest import TINY, typed

from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ROWS = load_track("Oval_track").rows


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A small run, and a route file it was not driven on; every case gets a copy."""
    place = tmp_path_factory.mktemp("kept")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        np.save("own.npy", ROWS)
        words = ("--track", "own.npy", "--run", "r", "--stop", "iterations=2", "--no-pictures")
        assert typed("train", *words, *TINY, "--set", "rollout.horizon=64") == 0
    return place


@pytest.fixture
def place(kept, tmp_path, monkeypatch):
    """The folder in which a case is laid out."""
    monkeypatch.setenv("RACECRAFT_TRACKS", str(tmp_path / "library"))
    shutil.copytree(kept, tmp_path, dirs_exist_ok=True)
    (tmp_path / "t.csv").write_bytes((tmp_path / "r" / "training-simtrace" / "0-iteration.csv").read_bytes())
    job = tmp_path / "r" / "job.json"
    job.write_text(job.read_text().replace(str(kept), str(tmp_path)))
    return tmp_path


def edit(name, change):
    """Return what changes a text file of the case."""

    def apply(place):
        path = place / name
        path.write_text(change(path.read_text()))

    return apply


def edit_bytes(name, change):
    def apply(place):
        path = place / name
        path.write_bytes(change(path.read_bytes()))

    return apply


def put(name, data):
    def apply(place):
        path = place / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data if isinstance(data, bytes) else data.encode())

    return apply


def env(line):
    """Return what lays a run.env beside nothing else; the line in question is the second."""
    return put("car/run.env", f"# mine\n{line}\n")


def route(change):
    def apply(place):
        np.save(place / "new.npy", change(ROWS.copy()))

    return apply


def column(name, value):
    """Return what writes a value into every row of a trace's column."""

    def change(text):
        head, *rows = text.splitlines()
        k = head.split(",").index(name)
        lines = [",".join([*cells[:k], value, *cells[k + 1 :]]) for cells in (row.split(",") for row in rows)]
        return "\n".join([head, *lines]) + "\n"

    return change


def half(data):
    return data[: len(data) // 2]


def one_bit(data):
    return data[:-3] + bytes([data[-3] ^ 1]) + data[-2:]


def newer(text):
    return text.replace('"version": 1', '"version": 99')


def newer_tensors(data):
    return data.replace(b'"version":"1"', b'"version":"9"')


def without(name):
    def apply(place):
        (place / name).unlink()

    return apply


def swapped(rows):
    rows[[10, 11]] = rows[[11, 10]]
    return rows


def nothing(place):
    pass


REPLAY = ["replay", "t.csv", "--track", "own.npy"]
TRAIN = ["train", "car", "--stop", "iterations=1", "--no-pictures"]
RESUME = ["train", "--run", "r", "--resume", "--stop", "iterations=3", "--no-pictures"]
EVALUATE = ["evaluate", "r", "--laps", "1", "--checkpoint", "last"]


IMPORT = ["tracks", "import", "new.npy"]
POLICY, STATE = "r/checkpoints/2.policy.safetensors", "r/checkpoints/2.state.safetensors"

CASES = {  # name: what is changed, what is asked, what the message holds
    # traces
    "a trace without X": (edit("t.csv", lambda t: t.replace(",X,", ",east,", 1)), REPLAY, ["t.csv:1: no column X"]),
    "an empty trace": (put("t.csv", ""), REPLAY, ["t.csv: the file is empty"]),
    "a trace that is a track": (nothing, ["replay", "own.npy", "--track", "own.npy"], ["own.npy", "expected"]),
    "a trace whose every row is cut": (
        edit("t.csv", lambda t: "\n".join([t.splitlines()[0], *["0,1.0"] * 5])), REPLAY,
        ["t.csv:2: 2 values where 18 are expected"],
    ),
    "a trace with places that are no numbers": (edit("t.csv", column("Y", "nan")), REPLAY, ["t.csv:2: Y is 'nan'"]),
    "a trace of a parked car": (
        edit("t.csv", column("episode_status", "prepare")), REPLAY, ["t.csv", "no row in which a car was driven"],
    ),
    "a trace of another track": (
        nothing, ["replay", "t.csv", "--track", "reinvent_base"], ["t.csv", "lie elsewhere", "Oval_track"],
    ),
    "a trace that is not there": (without("t.csv"), REPLAY, ["t.csv", "no such file"]),
    "a model folder without traces": (
        put("car/notes.txt", "x"), ["replay", "car", "--track", "own.npy"], ["car", "no log was found there"],
    ),
    "a page into no folder": (
        nothing, [*REPLAY, "--report", "no/such/page.html"], ["no/such/page.html", "its folder does not exist"],
    ),
    # env files
    "run.env: a misspelt race": (env("DR_RACE_TYPE=TIME_TRAIL"), TRAIN, ["run.env:2:", "Did you mean 'TIME_TRIAL'"]),
    "run.env: a start beyond the lap": (env("DR_TRAIN_START_POSITION_OFFSET=2"), TRAIN, ["run.env:2:", "from 0 to 1"]),
    "run.env: a misspelt stop": (env("RACECRAFT_STOP=minuts=3"), ["train", "car"], ["run.env:2:", "minutes"]),
    "run.env: an older model that is not there": (
        env("DR_LOCAL_S3_PRETRAINED=True"), TRAIN, ["run.env:2:", "there is no folder"],
    ),
    "run.env: an unknown checkpoint": (
        env("DR_LOCAL_S3_PRETRAINED=True\nDR_LOCAL_S3_PRETRAINED_CHECKPOINT=first"), TRAIN,
        ["run.env:3:", "last or best"],
    ),
    "run.env: no text": (put("car/run.env", b"\xff\xfe\x00DR"), TRAIN, ["run.env", "expected"]),
    # run folders of another version, damaged ones
    "a run of a newer version": (edit("r/job.json", newer), EVALUATE, ["r/job.json", "99", "upgrade"]),
    "a run of another program": (
        edit("r/job.json", lambda t: t.replace("racecraft run", "somebody's run")), EVALUATE,
        ["r/job.json", "expected"],
    ),
    "a job cut in half": (edit("r/job.json", half), EVALUATE, ["r/job.json:", "no valid JSON", "expected"]),
    "resuming over damaged metrics": (
        edit("r/metrics.jsonl", lambda t: "{'no'}\n" + t), RESUME, ["r/metrics.jsonl:1:", "expected one object"],
    ),
    "an index of a newer version": (
        edit("r/checkpoints/checkpoints.json", newer), EVALUATE, ["checkpoints.json", "version is 99", "Upgrade"],
    ),
    "weights cut in half": (edit_bytes(POLICY, half), EVALUATE, ["2.policy.safetensors", "half written", "expected"]),
    "weights with one bit turned": (
        edit_bytes(POLICY, one_bit), EVALUATE, ["2.policy.safetensors", "its digest does not match", "expected"],
    ),
    "weights of a newer version": (edit_bytes(POLICY, newer_tensors), EVALUATE, ["version 9", "expected version 1"]),
    "a state where weights should be": (
        lambda place: shutil.copy(place / STATE, place / POLICY), EVALUATE,
        ["2.policy.safetensors", "it says it is 'racecraft trainer state'"],
    ),
    "an unknown checkpoint": (nothing, [*EVALUATE[:-1], "99"], ["'99'", "best, last, or one of", "0 to 2"]),
    "resuming with a state with one bit turned": (edit_bytes(STATE, one_bit), RESUME, ["2.state.", "digest"]),
    "resuming without the copy of the reward": (
        without("r/reward_function.py"), RESUME, ["r/reward_function.py", "expected"],
    ),
    "resuming with a damaged copy of the car": (
        edit("r/model_metadata.json", half), RESUME, ["r/model_metadata.json", "JSON"],
    ),
    "resuming with damaged AWS metrics": (
        edit("r/metrics/TrainingMetrics.json", half), RESUME, ["TrainingMetrics.json", "expected"],
    ),
    "resuming on a track that has changed": (
        lambda place: np.save(place / "r/track.npy", ROWS * 1.1),
        RESUME,
        ["r/track.npy", "has changed since the run began"],
    ),
    "a report of a damaged evaluation": (
        edit("r/evaluations/2.json", half), ["report", "r"], ["r/evaluations/2.json", "expected an evaluation"],
    ),
    "a report of damaged episodes": (
        edit_bytes("r/episodes/2.parquet", half), ["report", "r"], ["r/episodes/2.parquet", "expected"],
    ),
    # tracks of one's own
    "importing a track that is not closed": (
        route(lambda r: r[:-1]), IMPORT, ["new.npy", "the last row ends", "Append a copy of row 0"],
    ),
    "importing rows out of order": (route(swapped), IMPORT, ["new.npy", "at row 1", "expected rows in driving order"]),
    "importing swapped borders": (
        route(lambda r: r[:, [0, 1, 4, 5, 2, 3]]), IMPORT, ["new.npy", "expected an outer border around", "Swap"],
    ),
    "importing under a name of the catalogue": (
        route(lambda r: r), [*IMPORT, "--name", "Bowtie_track"], ["the catalogue's Bowtie_track", "--name"],
    ),
    "importing under no name": (route(lambda r: r), [*IMPORT, "--name", "a/b"], ["the name 'a/b'", "letters, digits"]),
    "a library that is a file": (
        lambda place: (route(lambda r: r)(place), put("library", "x")(place)), IMPORT, ["library", "cannot be written"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_the_letter_names_the_file_and_what_to_do(name, racecraft, place):
    change, words, wanted = CASES[name]
    change(place)
    said = racecraft(*words)
    text = " ".join(said.err.split())
    assert said.code == 2, said.err + said.out
    assert "Traceback" not in text
    for part in wanted:
        assert part in text, text


def test_two_writers_are_kept_apart_whatever_they_want(racecraft, place):
    with RunFolder.open("r").lock():
        refused = racecraft(*RESUME)
        assert racecraft(*EVALUATE, "--json").code == 0, "who only reads is let in"
    assert refused.code == 2
    assert "another training holds it (process" in refused.err
    assert racecraft(*RESUME).code == 0


def test_one_damaged_row_is_passed_over_and_named(racecraft, place):
    lines = (place / "t.csv").read_text().splitlines()
    lines[4] = lines[4][:20]
    (place / "t.csv").write_text("\n".join(lines))
    said = racecraft(*REPLAY, "--json")
    assert said.code == 0
    assert "t.csv:5: " in said.err

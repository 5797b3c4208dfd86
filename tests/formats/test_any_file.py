"""By law: whatever bytes a file holds, a reader gives a value or a letter, never another error."""

import dataclasses
import json
import re

import numpy as np
import pytest

from racecraft.contract.errors import InputFileError, SeveralFaultsError
from racecraft.formats import checkpoint, episodes
from racecraft.worlds.deepracer.files import (
    hyperparameters,
    model_metadata,
    run_env,
    simulation_log,
    training_metrics,
    training_params,
)
from racecraft.worlds.deepracer.logs import one_trace
from racecraft.worlds.unity.files import demonstrations

TRACE_ROW = "0,1.0,3.2,0.68,0.16,-10.0,2.0,[-10.0 2.0],0.5,False,True,0.79,1,17.7,245.9,prepare,0.0,0,1.5"
METRICS = [training_metrics.evaluation_row(start_s=1, end_s=2, trial=1, progress_share=1, status="lap_complete")]
DEMONSTRATION = bytes.fromhex(
    "0408011801".ljust(66, "0")  # version 1, one record; padded to 33 bytes
    + "06"
    "1a0103"
    "3a0141"  # one branch of 3, named A
     + "19"
    "0a12"
    "3d0000003f"
    "6a0b"
    "0a0101"
    "22060a040000803f"
    "12033a0102"  # reward 0.5, sees 1.0, chose 2
)


def specimen(reader, path):
    """Write a sound file of the reader's kind."""
    if reader is model_metadata.read_model_metadata:
        model_metadata.write_model_metadata(model_metadata.default_model_metadata(), path)
    elif reader is hyperparameters.read_hyperparameters:
        hyperparameters.write_hyperparameters(hyperparameters.default_hyperparameters(), path)
    elif reader is run_env.read_run_env:
        path.write_text(run_env.run_env_text())
    elif reader is one_trace.read_sim_trace:
        path.write_text(f"{simulation_log.PREFIX}{TRACE_ROW}\n")
    elif reader is training_metrics.read_metrics_file:
        training_metrics.write_evaluation_metrics(path, METRICS)
    elif reader is training_params.read_params:
        training_params.write_params(path, {"A": "1", "B": ["x", "y"]})
    elif reader is demonstrations.read_demonstration:
        path.write_bytes(DEMONSTRATION)
    elif reader is checkpoint.load_state:
        checkpoint.save_state(path, {"n": 1, "w": np.zeros(3), "t": (1, {2: 3})})
    else:
        episodes.write_episodes(path, {name: np.arange(3) for name in ("episode", "tick", "time_s")})


READERS = [
    model_metadata.read_model_metadata,
    hyperparameters.read_hyperparameters,
    run_env.read_run_env,
    one_trace.read_sim_trace,
    training_metrics.read_metrics_file,
    training_params.read_params,
    demonstrations.read_demonstration,
    checkpoint.load_state,
    episodes.read_episodes,
]


def error_about(reader, path):
    """Return the letter a reader refuses the file with, or nothing when it reads it."""
    try:
        reader(path)
    except (InputFileError, SeveralFaultsError) as letter:
        return "\n".join(str(fault) for fault in getattr(letter, "faults", [letter]))
    return ""


def spoiled(data, rng):
    """Return the bytes with a few of them changed, taken out, doubled, or cut off."""
    data = bytearray(data)
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(0, len(data) + 1))
        to = min(len(data), at + int(rng.integers(1, 9)))
        how = rng.integers(0, 5)
        if how == 0:
            data[at:to] = b""
        elif how == 1:
            data[at:at] = bytes(rng.integers(0, 256, 3, dtype=np.uint8))
        elif how == 2:
            data[at:to] = rng.choice([b"null", b"1e999", b"{", b"]", b'"', b"NaN", b"-", b",", b"\xff", b"[[[", b"="])
        elif how == 3:
            data[at:at] = data[at:to] * 2
        else:
            del data[max(at, 1) :]
    return bytes(data)


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.__name__)
def test_a_spoiled_file_is_read_or_refused_by_letter(tmp_path, reader):
    path = tmp_path / "file"
    specimen(reader, path)
    sound, rng = path.read_bytes(), np.random.default_rng(7)
    reader(path)
    refused = 0
    for _ in range(150):
        path.write_bytes(spoiled(sound, rng))
        letter = error_about(reader, path)
        assert letter == "" or letter.startswith(str(path))
        refused += letter != ""
    assert refused > 3


def test_values_nested_beyond_reason_and_endless_numbers_are_refused(tmp_path):
    for text in ("[" * 100_000, '{"lr": ' + "9" * 5000 + "}", "[" * 900 + "]" * 900):
        (tmp_path / "h.json").write_text(text)
        assert error_about(hyperparameters.read_hyperparameters, tmp_path / "h.json").startswith(str(tmp_path))


JSON_VALUES = [
    None,
    True,
    1,
    -1.5,
    "x",
    [],
    {},
    [1, [2, {"a": None}]],
    {"low": 1},
    10**400,
    float("inf"),
    "1e999",
    [[]],
]


@pytest.mark.parametrize(
    ("reader", "keys"),
    [
        (model_metadata.read_model_metadata, model_metadata.KEYS),
        (hyperparameters.read_hyperparameters, hyperparameters.NAMES),
        (
            training_metrics.read_metrics_file,
            ("metrics", *(f.name for f in dataclasses.fields(training_metrics.EvaluationRow))),
        ),
    ],
    ids=["metadata", "hyperparameters", "metrics"],
)
def test_any_json_value_under_any_key_is_read_or_refused_by_letter(tmp_path, reader, keys):
    path = tmp_path / "file"
    specimen(reader, path)
    sound = json.loads(path.read_text())
    for key in keys:
        for value in JSON_VALUES:
            changed = {**sound, key: value}
            rows = sound.get("metrics")
            if rows and key != "metrics":
                changed = {"metrics": [{**rows[0], key: value}]}
            path.write_text(json.dumps(changed))
            letter = error_about(reader, path)
            faults = [line for line in letter.split("\n") if not re.fullmatch(r"\d+ faults:", line)]
            assert letter == "" or all(fault.lstrip().startswith(str(path)) for fault in faults), (key, value)

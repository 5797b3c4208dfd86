"""`hyperparameters.json`: real files, other spellings, wrong values."""

import json

import pytest
from tests.reference import DATA

from racecraft.contract.errors import HyperparameterError
from racecraft.worlds.deepracer.files.hyperparameters import (
    Hyperparameters,
    default_hyperparameters,
    read_hyperparameters,
    write_hyperparameters,
)


def read(tmp_path, text):
    path = tmp_path / "hyperparameters.json"
    path.write_text(text if isinstance(text, str) else json.dumps(text, indent=1), encoding="utf-8")
    return read_hyperparameters(path)


def test_every_real_file_reads_and_comes_back_the_same(tmp_path):
    paths = [*DATA.glob("models/**/hyperparameters.json"), *DATA.glob("traces/**/hyperparameters.json")]
    assert len(paths) >= 3
    for path in paths:
        hyperparameters = read_hyperparameters(path)
        assert hyperparameters.batch_size == 64, path
        assert hyperparameters.loss_type == "huber", path
        assert hyperparameters.term_cond_avg_score is None, path
        assert hyperparameters.term_cond_max_episodes is None, path
        write_hyperparameters(hyperparameters, tmp_path / "copy.json")
        assert read_hyperparameters(tmp_path / "copy.json") == hyperparameters


def test_the_template_of_deepracer_for_cloud_holds_what_it_holds():
    got = read_hyperparameters(DATA / "models/drfc-defaults/hyperparameters.json")
    assert (got.discount_factor, got.lr, got.num_epochs, got.sac_alpha) == (0.99, 0.0003, 5, 0.2)
    assert any("term_cond_avg_score 350 is a template's value" in note for note in got.notes)


def test_what_is_not_given_is_none_and_what_is_given_is_named(tmp_path):
    got = read(tmp_path, {"lr": 0.001, "num_epochs": None})
    assert got == Hyperparameters(lr=0.001)
    assert got.given == ("lr",)


@pytest.mark.parametrize(
    ("key", "value", "spellings"),
    [
        ("loss_type", "huber", ["huber", "Huber", " HUBER "]),
        ("loss_type", "mean squared error", ["mean squared error", "mean_squared_error", "Mean squared error", "MSE"]),
    ],
)
def test_words_are_read_in_any_case_and_spelling(tmp_path, key, value, spellings):
    assert {getattr(read(tmp_path, {key: text}), key) for text in spellings} == {value}


def test_numbers_written_as_text_and_names_written_otherwise_are_read(tmp_path):
    got = read(tmp_path, {"batch_size": "64.0", "Ir": "3e-4", "Discount-Factor": " 0.95 ", "numepochs": 3})
    assert got == Hyperparameters(batch_size=64, lr=3e-4, discount_factor=0.95, unknown={"numepochs": 3})
    told = " | ".join(got.notes)
    assert "'Ir' is read as 'lr'" in told
    assert "Did you mean 'num_epochs'?" in told


@pytest.mark.parametrize(
    ("key", "templates", "chosen"),
    [("term_cond_avg_score", [350, 1000.0, "100000"], 200.0), ("term_cond_max_episodes", [1000, 5000, 100000], 400)],
)
def test_a_stop_condition_counts_only_when_somebody_chose_it(tmp_path, key, templates, chosen):
    for value in templates:
        got = read(tmp_path, {key: value})
        assert got.given == ()
        assert key in got.notes[0]
    assert getattr(read(tmp_path, {key: chosen}), key) == chosen


def test_the_defaults_come_back_as_they_were_written(tmp_path):
    write_hyperparameters(default_hyperparameters(), tmp_path / "h.json")
    assert read_hyperparameters(tmp_path / "h.json") == default_hyperparameters()
    assert read_hyperparameters(tmp_path / "h.json").notes == ()


WRONG = [  # key, value, found, expected
    ("lr", "fast", "'fast'", "a number from 1e-08 to 1"),
    ("batch_size", 64.5, "64.5", "a whole number"),
    ("batch_size", True, "True", "a whole number"),
    ("discount_factor", 99, "99", "a number from 0 to 1"),
    ("discount_factor", float("nan"), "nan", "a number from 0 to 1"),
    ("epsilon_steps", float("inf"), "inf", "a whole number"),
    ("term_cond_avg_score", 1e9 + 1, "1000000001.0", "a number from -1e+09 to 1e+09"),
    ("loss_type", "hubert", "'hubert'", "Did you mean 'huber'?"),
]


@pytest.mark.parametrize(("key", "value", "found", "expected"), WRONG)
def test_a_wrong_value_gets_a_letter_with_line_and_key(tmp_path, key, value, found, expected):
    with pytest.raises(HyperparameterError) as caught:
        read(tmp_path, {"remark": "first", key: value})
    letter = str(caught.value)
    place = f"{tmp_path / 'hyperparameters.json'}:3: {key}: "
    assert letter.startswith(place + found)
    assert expected in letter.removeprefix(place)


def test_a_key_that_is_given_twice_is_told(tmp_path):
    got = read(tmp_path, '{"lr": 0.1, "lr": 0.0001}')
    assert (got.lr, got.notes) == (0.0001, ("'lr' is given twice; the last one counts",))


def test_no_json_object_gets_a_letter(tmp_path):
    with pytest.raises(HyperparameterError, match=r"hyperparameters.json:1: .*comma stands after the last"):
        read(tmp_path, '{"lr": 1,\n}')
    with pytest.raises(HyperparameterError, match="no JSON object"):
        read(tmp_path, "3")


CONSOLES = [  # taken without a word, taken with one, which
    ("batch_size", (32, 64, 128, 256, 512), (31, 33, 65, 127, 255, 257, 511, 513), "32, 64, 128, 256, 512"),
    ("lr", (1e-8, 1e-3), (1.001e-3,), "1e-08 to 0.001"),
    ("num_episodes_between_training", (1, 100), (101,), "1 to 100"),
    ("num_epochs", (3, 10), (2, 11), "3 to 10"),
]
"""Limits of AWS's console and of the DeepRacer-on-AWS model."""


@pytest.mark.parametrize(("name", "silent", "noted", "said"), CONSOLES)
def test_what_consoles_take_is_taken_without_a_word(tmp_path, name, silent, noted, said):
    for value in silent:
        assert read(tmp_path, {name: value}).notes == ()
    for value in noted:
        assert read(tmp_path, {name: value}).notes == (f"{name} {value:g} trains here; AWS consoles take {said}",)


def test_the_defaults_are_deepracer_for_clouds():
    template = read_hyperparameters(DATA / "models/drfc-defaults/hyperparameters.json")
    defaults = default_hyperparameters()
    assert defaults.given == (
        "batch_size", "beta_entropy", "discount_factor", "exploration_type", "loss_type", "lr",
        "num_episodes_between_training", "num_epochs",
    )  # fmt: skip
    assert {name: getattr(defaults, name) for name in defaults.given} == {
        name: getattr(template, name) for name in defaults.given
    }


@pytest.mark.parametrize(("written", "name"), [("Learning Rate", "lr"), ("entropy", "beta_entropy")])
def test_a_name_in_another_spelling_is_read_and_told(tmp_path, written, name):
    got = read(tmp_path, {written: 0.5})
    assert (getattr(got, name), got.unknown) == (0.5, {})
    assert f"'{written}' is read as '{name}'" in got.notes


def test_a_file_is_written_for_people_with_what_nobody_knew(tmp_path):
    write_hyperparameters(Hyperparameters(lr=0.001, unknown={"mine": [1]}), tmp_path / "h.json")
    assert (tmp_path / "h.json").read_text() == '{\n  "lr": 0.001,\n  "mine": [\n    1\n  ]\n}\n'


def test_a_name_that_is_nobodys_is_kept_and_told(tmp_path):
    got = read(tmp_path, {"my_remark": 1, "num_epoch": 3})
    assert got.unknown == {"my_remark": 1, "num_epoch": 3}
    assert got.notes == (
        "unknown key 'my_remark' is kept and does nothing",
        "unknown key 'num_epoch' is kept and does nothing. Did you mean 'num_epochs'?",
    )

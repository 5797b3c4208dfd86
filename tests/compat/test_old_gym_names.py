"""Names of the old gym and of TensorFlow that scripts ask for on their way to what they want."""

import sys

import numpy as np
import pytest

from racecraft.compat.shims import run_script
from racecraft.contract.errors import UserInputError


@pytest.fixture
def ran(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(text, **beside):
        for name, module in beside.items():
            (tmp_path / f"{name}.py").write_text(module)
        (tmp_path / "script.py").write_text(text)
        run_script("script.py")
        return capsys.readouterr().out

    return run


def test_bounds_that_a_type_cannot_hold_make_floats_of_it(ran):
    said = ran(
        "from gym import spaces\nimport gym\n"
        "box = spaces.Box(low=-1, high=5, shape=(2, 2), dtype=__import__('numpy').uint8)\n"
        "kept = spaces.Box(0, 255, (3,), 'uint8')\n"
        "print(box.dtype, box.low.min(), kept.dtype, isinstance(box, gym.spaces.space.Space))\n"
        "print(spaces.Box(low=__import__('numpy').array([-1.0, -2.0]), high=1.0).shape)\n"
    )
    assert said == "float32 -1.0 uint8 True\n(2,)\n"


def test_a_stream_of_chance_is_numpys_old_one(ran):
    said = ran("from gym.utils import seeding\nrandom, seed = seeding.np_random(7)\nprint(seed, random.randint(100))")
    assert said == f"7 {np.random.RandomState(7).randint(100)}\n"


@pytest.mark.skipif("tensorflow" in sys.modules, reason="a real TensorFlow is loaded")
def test_a_script_may_import_tensorflow_and_ask_nothing_of_it(ran):
    beside = "import tensorflow as tf\nfound = hasattr(tf, 'io')"
    assert ran("import beside\nprint(beside.found)", beside=beside) == "False\n"
    with pytest.raises(UserInputError, match=r"script\.py:2: tensorflow\.keras: TensorFlow is not installed"):
        ran("import tensorflow as tf\ntf.keras.Model()")
    assert "tensorflow" not in sys.modules


@pytest.mark.skipif("tensorflow" in sys.modules, reason="a real TensorFlow is loaded")
def test_packages_that_look_for_tensorflow_find_none(tmp_path, monkeypatch, capsys):
    (tmp_path / "installed").mkdir()
    (tmp_path / "installed" / "looks_for_it.py").write_text(
        "try:\n    import tensorflow\n    found = True\nexcept ImportError:\n    found = False\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path / "installed"))
    (tmp_path / "mine").mkdir()
    monkeypatch.chdir(tmp_path / "mine")
    (tmp_path / "mine" / "own.py").write_text("import looks_for_it\nprint(looks_for_it.found)")
    run_script("own.py")
    assert capsys.readouterr().out == "False\n"

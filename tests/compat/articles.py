"""The two articles of AWS on SageMaker RL, as notebooks: what they print, and what a reader adds to it.

They lie beside a checkout where their owners' texts may; nothing of them is kept here. Their lines have lost their
indentation, which the digits give back.
"""

import json
from pathlib import Path

import pytest

SEEDS = Path(__file__).resolve().parents[2] / ".." / "shared" / "seeds"
UNITY, SNAKES = "2-sagemaker-rl-unity.ja.txt", "4-sagemaker-rl-battlesnake.ja.txt"
WRAPPER_DEPTHS = "01223333345666645452334566645452221212"
SETUP_DEPTHS = "0000000000001011001010"


def article(name):
    """Return an article's text; skip the test where it is not there."""
    if not (SEEDS / name).exists():
        pytest.skip("the article does not lie beside the checkout")
    return (SEEDS / name).read_text(encoding="utf-8")


def cut(text, first, behind):
    """Return what stands from one piece of text up to another."""
    begin = text.index(first)
    return text[begin : text.index(behind, begin)]


def unity_script():
    """Return the script of the article on Unity, word for word."""
    text, end = article(UNITY), "MyLauncher().train_main()"
    launcher = (cut(text, "class MyLauncher", end) + end).splitlines()
    depths = {"class": 0, "def": 1, "if": 0, end: 1}
    lines = [4 * depths.get(line.split()[0], 2) * " " + line for line in launcher]
    imports = cut(text, "import json\nimport os\nimport gym", "class UnityEnvWrapper")
    return imports + unity_wrapper() + "\n".join(lines) + "\n"


def unity_wrapper():
    """Return the class of that script that wraps the scene."""
    lines = cut(article(UNITY), "class UnityEnvWrapper", "class MyLauncher").splitlines()
    return "".join(4 * int(depth) * " " + line + "\n" for depth, line in zip(WRAPPER_DEPTHS, lines, strict=True))


def unity_cells():
    """Return the cells of the article on Unity: what is set up, and the job."""
    text = article(UNITY)
    lines = cut(text, "import sagemaker\nimport boto3", "Docker イメージのビルド").splitlines()
    set_up = "\n".join(4 * int(depth) * " " + line for depth, line in zip(SETUP_DEPTHS, lines, strict=True))
    return [set_up, cut(text, "metric_definitions = RLEstimator", "上記のコードでは")]


def snake_cells():
    """Return the cells of the article on snakes: one instance, three, two clusters' figures, two clusters."""
    text = article(SNAKES)
    return [
        cut(text, "NUM_ITERATION = 5000", "RL トレーニングを複数"),
        cut(text, "train_instance_count = 3", "ロールアウトワーカーの数を増やすと"),
        cut(text, 's3_prefix = "<s3', "次のコードを使用して、プライマリ"),
        cut(text, "primary_estimator = RLEstimator", "実験\n"),
    ]


def write_notebook(path, cells):
    """Write a notebook of these cells."""
    told = [{"cell_type": "code", "source": cell.splitlines(keepends=True)} for cell in cells]
    path.write_text(json.dumps({"cells": told}), encoding="utf-8")
    return path

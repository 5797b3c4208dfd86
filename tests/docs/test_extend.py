"""Every example of docs/extend.md runs: the package that they make up is installed and used."""

import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
from strangers import Stranger, install  # noqa: E402

PAGE = (Path(__file__).parents[2] / "docs" / "extend.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """Whoever installed the package: runs code in a folder of their own."""
    folder = tmp_path_factory.mktemp("extended")
    (folder / "mine").mkdir()
    (folder / "pyproject.toml").write_text(re.search(r"```toml\n(\[project\].*?)```", PAGE, re.DOTALL)[1])
    for place, text in re.findall(r"```python\n# (mine/\w+\.py)\n(.*?)```", PAGE, re.DOTALL):
        (folder / place).write_text(text)
    install(folder, folder / "site")
    stranger = Stranger([folder / "site", folder], folder)
    yield lambda code: stranger(code=code)
    stranger.close()


def test_an_algorithm_trains_by_its_name(asked):
    code = """
import racecraft as rc
trained = rc.train("gymnasium", environment="CartPole-v1", algorithm="cautious", stops="iterations=1", quiet=True)
print(rc.read_run(trained.run.path).job["algorithm"])
from racecraft.algorithms.registry import all_algorithms
print("REINFORCE in small steps." in [one.title for one in all_algorithms()])
"""
    assert asked(code).splitlines()[:2] == ["cautious", "True"]


def test_a_player_plays_by_its_name(asked):
    code = """
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.players.find import PlayerError, find_player
for place in ((2, 1), (0, 1)):
    print(find_player("homesick").choose(Board(5, 5, snakes=[Snake("me", [place] * 3)], food=[]), None, "me", 1.0))
try:
    find_player("homesik")
except PlayerError as error:
    print(error)
"""
    told = asked(code).splitlines()
    assert told[:2] == ["left", "down"]
    assert "Did you mean 'homesick'" in told[2]


def test_a_track_is_found_by_its_name(asked):
    code = "import racecraft as rc; track = rc.load_track('Ring'); print(track.name, round(track.length, 1))"
    assert asked(code).splitlines()[0] == "Ring 18.8", "2 pi 3 m"


def test_a_reward_function_is_copied_into_a_new_folder(asked):
    code = """
import sys
from pathlib import Path
from racecraft.cli.entry import main
sys.argv = ["racecraft", "new", "my-car", "--reward", "centre"]
main()
"""
    end = "\nprint(Path('my-car/reward_function.py').read_text())"
    told = asked(code.replace("main()\n", f"try:\n    main()\nexcept SystemExit:\n    pass{end}\n"))
    assert "Pay for the middle of the road." in told


def test_a_plot_is_made_of_ticks(asked):
    code = """
import polars as pl
from racecraft.analysis.custom_plots import own_plots
ticks = pl.DataFrame({"iteration": [1, 1, 2], "speed": [1.0, 3.0, 2.0]})
plot, = own_plots()
print(plot.name, plot(ticks, None).title)
"""
    assert asked(code).splitlines()[0] == "speeds Mean speed of every iteration."

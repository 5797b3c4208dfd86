"""The notebooks: every code cell of every one is run, over a log of each kind."""

import json
import os

import numpy as np
import pytest
from tests.reference import HAS_ALL, LARGE, TRACES
from tests.worlds.deepracer.logs import makers

from racecraft.analysis.plot import Plot
from racecraft.worlds.deepracer.analysis.logs import workshop_plots as old_plots
from racecraft.worlds.deepracer.logs import local_streams, read, workshop_api
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.notebooks.write import MODULES, NOTEBOOKS, NotebookError, write_notebooks

TINY = {
    "camera.width": 16, "camera.height": 12, "rollout.num_worlds": 4, "rollout.horizon": 16,
    "evaluation.episodes": 2, "race.max_episode_seconds": 2, "network.conv_filters": 4, "network.conv_kernels": 4,
    "network.conv_strides": 2, "network.hidden_units": 8, "runtime.threads": 1,
}  # fmt: skip
OF_LOGS = ("Training_analysis.ipynb", "Evaluation_analysis.ipynb", "Metrics.ipynb", "ActionSpace_analysis.ipynb")


def run_cells(path, monkeypatch, replaced=(), draws=True):
    """Run a notebook's code as Jupyter would, and draw what the last line of a cell shows; return what was shown."""
    import ast

    monkeypatch.chdir(path.parent)
    monkeypatch.syspath_prepend(str(path.parent))
    names, shown = {}, []
    for number, cell in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"]):
        if cell["cell_type"] != "code":
            continue
        source = "".join(cell["source"])
        for text, other in replaced:
            source = source.replace(text, other)
        tree = ast.parse(source, f"{path.name}, cell {number}")
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, f"{path.name}, cell {number}", "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), f"{path.name}, cell {number}", "eval"), names)
            if draws and isinstance(value, Plot):
                assert value._repr_png_()[:4] == b"\x89PNG"
            shown.append(value)
    return shown


def plots_in(shown):
    return {one.name for one in shown if isinstance(one, Plot)}


@pytest.fixture
def model(tmp_path):
    """A DeepRacer for Cloud model: two iterations, an evaluation of three laps."""
    folder = tmp_path / "runs" / "model"
    for k in range(2):
        columns = makers.joined(
            *(makers.episode(4 * k + n, 1.0, ticks=60 + 3 * n, status="lap_complete") for n in range(3)),
            makers.episode(4 * k + 3, 0.3),
        )
        makers.write(folder / "training-simtrace" / f"{k}-iteration.csv", columns)
    makers.write(folder / "evaluation-20220709200242" / "evaluation-simtrace" / "0-iteration.csv", makers.lap_by_lap(3))
    return folder


def test_notebooks_are_jupyters_own_format(tmp_path):
    written = write_notebooks(tmp_path / "nb")
    assert {path.name for path in written} == {*NOTEBOOKS, *MODULES}
    for path in written:
        if path.suffix != ".ipynb":
            continue
        told = json.loads(path.read_text(encoding="utf-8"))
        assert (told["nbformat"], told["nbformat_minor"]) == (4, 5)
        assert len({cell["id"] for cell in told["cells"]}) == len(told["cells"])
        for cell in told["cells"]:
            assert ("outputs" in cell) == (cell["cell_type"] == "code")
            assert '"<' not in "".join(cell["source"])


def test_notebooks_that_are_there_are_left_alone(tmp_path):
    write_notebooks(tmp_path)
    mine = tmp_path / "Metrics.ipynb"
    mine.write_text("mine")
    with pytest.raises(NotebookError, match="is there already"):
        write_notebooks(tmp_path)
    assert mine.read_text() == "mine"
    write_notebooks(tmp_path, replace=True)
    assert mine.read_text() != "mine"


@pytest.mark.parametrize("name", OF_LOGS)
def test_the_notebooks_of_logs_run(tmp_path, model, monkeypatch, name):
    write_notebooks(tmp_path / "nb", logs=str(model))
    found = plots_in(run_cells(tmp_path / "nb" / name, monkeypatch))
    expected = {
        "Training_analysis.ipynb": {"training_progress", "stability", "scatter", "scatter_complete", "quintiles",
                                    "top_iterations", "heat_map", "one_episode", "one_iteration", "action_breakdown",
                                    "exit_points", "new_reward", "episode_distributions", "fitted_line"},
        "Evaluation_analysis.ipynb": {"evaluation_grid"},
        "Metrics.ipynb": set(),
        "ActionSpace_analysis.ipynb": {"action_histogram", "action_space", "action_sequences", "action_map",
                                       "action_heat_maps", "reward_per_waypoint", "one_episode"},
    }  # fmt: skip
    assert expected[name] <= found


@pytest.mark.skipif(not HAS_ALL, reason=LARGE)
@pytest.mark.parametrize("name", [pytest.param(OF_LOGS[0], marks=pytest.mark.long), *OF_LOGS[1:]])
def test_the_notebooks_of_logs_run_over_the_console(tmp_path, monkeypatch, name):
    write_notebooks(tmp_path, logs=str(TRACES / "console-2022"))
    found = plots_in(run_cells(tmp_path / name, monkeypatch, draws=False))  # they are drawn above
    assert name != "Metrics.ipynb" or {"completion_progress", "lap_time_progress", "lap_scatter"} <= found


def test_the_workshops_notebook_runs_over_local_logs(tmp_path, model, monkeypatch, capsys):
    monkeypatch.setenv(local_streams.ROOT, "")  # the notebook sets it; taken back at the end
    write_notebooks(tmp_path / "nb", run=str(model))
    found = plots_in(run_cells(tmp_path / "nb" / "DeepRacer Log Analysis.ipynb", monkeypatch))
    expected = {"training_progress", "trackpoints", "heat_map", "one_episode", "action_breakdown",
                "rewards_and_lengths", "evaluation_grid"}  # fmt: skip
    assert expected <= found
    logs = sorted((tmp_path / "nb" / "logs").iterdir())
    assert [path.name.startswith("deepracer-sim-") and path.suffix == ".log" for path in logs] == [True, True]
    assert "Distance, lap time" in capsys.readouterr().out


def test_the_workshops_notebook_begins_with_the_log_that_was_named(tmp_path, model, monkeypatch):
    """And not with the newest one beside it."""
    monkeypatch.setenv(local_streams.ROOT, "")
    other = model.parent / "newer"
    makers.write(other / "training-simtrace" / "0-iteration.csv", makers.episode(0, 0.3, ticks=7))
    write_notebooks(tmp_path / "nb", logs=str(model))
    shown = run_cells(tmp_path / "nb" / "DeepRacer Log Analysis.ipynb", monkeypatch, draws=False)
    (lengths,) = (one for one in shown if isinstance(one, Plot) and one.name == "rewards_and_lengths")
    assert lengths.data.height == 8, "two iterations of four episodes"
    assert lengths.data["steps"].max() == 66


def test_a_log_that_is_a_run_is_the_run_that_notebooks_open(tmp_path):
    run = tmp_path / "elsewhere" / "mine"
    run.mkdir(parents=True)
    (run / "job.json").write_text("{}")
    write_notebooks(tmp_path / "nb", logs=str(run))
    looking = (tmp_path / "nb" / "Visual_Analysis.ipynb").read_text()
    assert f"RUN = {str(run)!r}" in looking


def test_only_the_notebooks_that_were_named_are_written(tmp_path):
    (path,) = write_notebooks(tmp_path, names=["Metrics.ipynb", "another.ipynb"])
    assert [one.name for one in tmp_path.iterdir()] == [path.name] == ["Metrics.ipynb"]
    write_notebooks(tmp_path / "workshop", names=["DeepRacer Log Analysis.ipynb"])
    assert {one.name for one in (tmp_path / "workshop").glob("*.py")} == set(MODULES)


def test_training_and_looking_notebooks_run(tmp_path, monkeypatch):
    write_notebooks(tmp_path)
    small = [('STOPS = ["minutes=2"]', 'STOPS = ["iterations=1"]'), ("SETTINGS = {}", f"SETTINGS = {TINY}"),
             ("laps=3", "laps=1")]  # fmt: skip
    shown = run_cells(tmp_path / "rl_deepracer_robomaker_coach.ipynb", monkeypatch, small)
    assert any(isinstance(one, dict) and one.get("track") == "reinvent_base" for one in shown)
    (run,) = (tmp_path / "runs").iterdir()
    write_notebooks(tmp_path / "nb", run=str(run))
    shown = run_cells(tmp_path / "nb" / "Visual_Analysis.ipynb", monkeypatch)
    assert any(isinstance(one, list) and isinstance(one[0], dict) and "chosen_share" in one[0] for one in shown)
    monkeypatch.setenv(local_streams.ROOT, "")
    shown = run_cells(tmp_path / "nb" / "DeepRacer Log Analysis.ipynb", monkeypatch, draws=False)
    assert any(isinstance(one, list) and isinstance(one[0], dict) and "chosen_share" in one[0] for one in shown)


# --- the old names ------------------------------------------------------------------------------------------------


def test_old_tables_have_centimetres_and_degrees_and_lead_back(tmp_path):
    columns = makers.joined(makers.episode(0, 0.3), makers.episode(1, 1.0, ticks=60, status="lap_complete"))
    path = tmp_path / "a.log"
    path.write_text(makers.log_text(columns))
    data = workshop_api.load_data(path)
    assert len(data) == 72
    table = workshop_api.convert_to_pandas(data, episodes_per_iteration=1)
    assert table["iteration"].tolist() == [1] * 12 + [2] * 60
    assert np.abs(table["x"] / 100 - columns["X"]).max() < 1e-3
    assert table["done"].sum() == 2
    back = workshop_api.ticks_of(table)
    new = read(path).ticks.collect()
    for name in ("x_m", "yaw_rad", "steering_rad", "progress_share", "reward", "time_s"):
        assert np.abs(back[name].to_numpy() - new[name].to_numpy()).max() < 1e-3, name
    assert back["status"].to_list()[-1] == "lap_complete"
    places, ticks, best = workshop_api.episode_parser(data)
    assert best == [1, 0]
    assert ticks[1].shape == (60, 6)
    assert sum(map(len, places.values())) == 72


def test_a_run_becomes_the_same_rows_as_its_log(tmp_path):
    columns = makers.episode(0, 0.3)
    (tmp_path / "a.log").write_text(makers.log_text(columns))
    makers.write(tmp_path / "trace" / "0-iteration.csv", columns)
    ours = [workshop_api._fields(row) for row in workshop_api.load_data(tmp_path / "trace" / "0-iteration.csv")]
    theirs = [workshop_api._fields(row) for row in workshop_api.load_data(tmp_path / "a.log")]
    for one, other in zip(ours, theirs, strict=True):
        assert [float(a) for a in one[:9]] == pytest.approx([float(b) for b in other[:9]], abs=1e-3)
        assert one[9:11] == other[9:11]


def test_streams_are_told_apart_ordered_and_filtered(model, tmp_path, monkeypatch):
    monkeypatch.setenv(local_streams.ROOT, str(model.parent))
    found = local_streams.streams()
    assert sorted(stream.phase for stream in found) == ["evaluation", "training"]
    assert len({stream.simulation for stream in found}) == 2
    assert [stream.last_ms for stream in found] == sorted(stream.last_ms for stream in found)
    assert local_streams.streams(local_streams.LEADERBOARDS) == []
    for file in model.rglob("*"):
        os.utime(file, (1e9, 1e9))
    told = local_streams.download_all_logs(str(tmp_path / "out" / "p-"), local_streams.SIMULATIONS)
    assert [last for *_, last in told] == [10**12, 10**12]
    old = local_streams.download_all_logs(str(tmp_path / "q-"), local_streams.SIMULATIONS, not_older_than="2002-01-01")
    assert old == []
    with pytest.raises(LogError, match="sim-nothing"):
        local_streams.download_log(tmp_path / "x", "sim-nothing")
    with pytest.raises(LogError, match="one of /aws/robomaker"):
        local_streams.streams("/aws/robomaker/Simulation")


def test_an_evaluation_has_its_own_log_with_episodes_from_nought(model, tmp_path, monkeypatch):
    monkeypatch.setenv(local_streams.ROOT, str(model.parent))
    name = local_streams.simulation_id(model, "evaluation")
    local_streams.download_log(tmp_path / "e.log", name)
    table = workshop_api.convert_to_pandas(workshop_api.load_data(tmp_path / "e.log"))
    assert table["episode"].unique().tolist() == [0, 1, 2]


def test_points_lines_and_boxes_are_drawn_where_they_are():
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    square = np.array([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]])
    old_plots.plot_coords(axes, square)
    old_plots.plot_line(axes, square)
    assert [line.get_xydata().tolist() for line in axes.lines] == [square.tolist()] * 2
    assert old_plots.make_error_boxes(axes, [10], [20], np.array([[1], [2]]), np.array([[3], [4]])) == 0
    (box,) = axes.collections[0].get_paths()
    assert box.get_extents().extents.tolist() == [9.0, 17.0, 12.0, 24.0]


def test_a_lap_on_a_grid_by_hand():
    """Three ticks 10 cm apart along x, 0.5 s, throttle 1, 2, 3: 20 cm at 0.4 m/s; squares of 10 cm hold one each."""
    lap = {"x": [105.0, 115.0, 125.0], "y": [105.0] * 3, "throttle": [1.0, 2.0, 3.0], "timestamp": [4.0, 4.25, 4.5]}
    said = []
    square = [[100, 100], [200, 100], [200, 200], [100, 200]]
    hole = [[140, 140], [160, 140], [160, 160], [140, 160]]
    seconds, mean, (stats,) = old_plots.plot_grid_world(lap, hole, square, plot=False, on_message=said.append)
    assert (seconds, mean) == (0.5, 2.0)
    assert stats == pytest.approx((0.2, 0.5, 0.4, 2.0, 1.0, 3.0))
    assert said[0] == "Distance, lap time = 0.20 (meters), 0.50 (sec)"
    grid = old_plots.grid_of(*(np.array(lap[n]) for n in ("x", "y", "throttle")), np.array(hole), np.array(square), 10)
    assert grid[10, 10:13].tolist() == [1.0, 2.0, 3.0]
    assert grid[18, 18] == -1.0
    assert np.isnan(grid[15, 15])
    assert np.isnan(grid[5, 5])

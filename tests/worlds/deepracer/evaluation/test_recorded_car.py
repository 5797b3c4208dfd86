"""Which recordings are asked about their car, and what they say, by numbers that a test writes."""

from racecraft.worlds.deepracer.evaluation import recorded_car as module
from racecraft.worlds.deepracer.evaluation.recorded_car import recorded_car
from racecraft.worlds.deepracer.logs.errors import LogError


def touched(folder, **sizes):
    for name, size in sizes.items():
        path = folder / name.replace("__", "/").replace("_iteration", "-iteration.csv")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x" * size)


def test_the_three_largest_traces_beside_a_racers_files_are_asked(tmp_path, monkeypatch):
    touched(tmp_path, a_iteration=5, my_trace__deep__b_iteration=9, sim_trace__c_iteration=9, trace__d_iteration=7,
            elsewhere__e_iteration=99, trace__f_notes=99)  # fmt: skip
    asked = []

    def read(path):
        asked.append(path.relative_to(tmp_path).as_posix())
        raise LogError(path, "damaged", "a trace")

    monkeypatch.setattr(module, "read_sim_trace", read)
    assert recorded_car(str(tmp_path)) is None
    assert asked == ["my_trace/deep/b-iteration.csv", "sim_trace/c-iteration.csv", "trace/d-iteration.csv"]
    assert recorded_car(tmp_path / "nothing") is None

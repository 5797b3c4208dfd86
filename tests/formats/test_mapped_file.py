"""Arrays on the disk: seen as they are, in memory only piece by piece."""

import os

import numpy as np
import pytest

from racecraft.formats import mapped_file
from racecraft.formats.mapped_file import array_on_disk, let_go, map_file, pieces, spans
from racecraft.formats.tensor_file import digest, read_tensors, write_tensors
from racecraft.worlds.deepracer.files.tensorflow.arithmetic import GraphFunction
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, Node


@pytest.fixture
def numbers(tmp_path):
    (tmp_path / "numbers").write_bytes(np.arange(35, dtype="<f4").tobytes())
    return np.frombuffer(map_file(tmp_path / "numbers"), "<f4").reshape(7, 5)


def resident(path):
    """Return how many bytes of a mapped file are in this process's memory, as Linux tells it."""
    with open("/proc/self/smaps") as maps:
        lines = iter(maps.read().splitlines())
    return sum(
        int(next(line for line in lines if line.startswith("Rss:")).split()[1]) * 1024
        for line in lines
        if line.endswith(str(path))
    )


def test_what_was_let_go_is_the_same_when_it_comes_again(numbers):
    assert numbers.sum() == 595
    let_go(numbers)
    let_go(numbers.T[1:])
    assert numbers.sum() == 595


@pytest.mark.skipif(not mapped_file.Path("/proc/self/smaps").exists(), reason="Linux tells what is in memory")
def test_pieces_of_a_large_file_are_in_memory_one_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setattr(mapped_file, "PIECE_BYTES", 2**20)
    path = tmp_path / "large"
    path.write_bytes(bytes(8 * 2**20))
    array = np.frombuffer(map_file(path), np.uint8)
    most = max(resident(path) for piece in pieces(array) if not piece.any())
    assert 0 < most <= 2 * 2**20
    assert array.sum() == 0
    assert resident(path) > 4 * 2**20


def test_rows_larger_than_a_piece_are_looked_at_one_by_one():
    assert list(spans(3, 2 * mapped_file.PIECE_BYTES)) == [slice(0, 1), slice(1, 2), slice(2, 3)]


def test_an_empty_file_is_an_empty_view(tmp_path):
    (tmp_path / "nothing").write_bytes(b"")
    assert bytes(map_file(tmp_path / "nothing")) == b""


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names are POSIX's")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", tmp_path):
        with pytest.raises(OSError, match="no plain file"):
            map_file(path)


def test_an_array_on_the_disk_holds_what_is_written_into_it():
    array = array_on_disk((3, 4), np.float32)
    assert not array.any()
    array[1] = 2.5
    let_go(array)
    assert array.tolist() == [[0] * 4, [2.5] * 4, [0] * 4]


@pytest.mark.parametrize("piece", [4, 24, 2**23])
def test_pieces_change_nothing_of_what_is_written(piece, numbers, tmp_path, monkeypatch):
    arrays = {"rows": numbers, "transposed": numbers.T, "one": numbers[0, 0], "column": numbers[:, 2],
              "turned": numbers.reshape(7, 5, 1).transpose(2, 1, 0)}  # fmt: skip
    whole = digest({name: np.ascontiguousarray(array).reshape(array.shape) for name, array in arrays.items()})
    monkeypatch.setattr(mapped_file, "PIECE_BYTES", piece)
    write_tensors(tmp_path / "file", "test", arrays, {})
    read, _ = read_tensors(tmp_path / "file", "test")
    assert digest(arrays) == digest(read) == whole
    for name, array in arrays.items():
        np.testing.assert_array_equal(read[name], array)


@pytest.mark.parametrize("matrix", ["rows", "transposed"])
def test_a_product_in_pieces_is_the_product(matrix, numbers, monkeypatch):
    right = numbers if matrix == "rows" else numbers.T
    left = np.random.default_rng(1).random((2, len(right)), np.float32)
    graph = Graph([Node("x", "Placeholder"), Node("w", "Const", (), {"value": right}), Node("y", "MatMul", ("x", "w"))])
    monkeypatch.setattr("racecraft.worlds.deepracer.files.tensorflow.arithmetic.PIECE_BYTES", 40)
    monkeypatch.setattr(mapped_file, "PIECE_BYTES", 40)
    np.testing.assert_allclose(GraphFunction(graph, "y")({"x": left}), left @ right, rtol=1e-6)


@pytest.mark.parametrize(
    ("length", "bytes_each", "expected"),
    [
        (0, 1, []),
        (4, 4, [(0, 4)]),
        (5, 4, [(0, 4), (4, 5)]),
        (9, 4, [(0, 4), (4, 8), (8, 9)]),
        (2, 16, [(0, 1), (1, 2)]),
        (3, 9, [(0, 1), (1, 2), (2, 3)]),
        (20, 0, [(0, 16), (16, 20)]),
    ],
)
def test_a_piece_holds_as_many_as_it_has_room_for(monkeypatch, length, bytes_each, expected):
    monkeypatch.setattr(mapped_file, "PIECE_BYTES", 16)
    assert [(part.start, part.stop) for part in spans(length, bytes_each)] == expected


def test_every_piece_is_let_go_behind_it_and_an_array_in_memory_is_left_alone(numbers, monkeypatch):
    monkeypatch.setattr(mapped_file, "PIECE_BYTES", 40)
    gone = []
    monkeypatch.setattr(mapped_file, "let_go", lambda array: gone.append(array.size))
    assert [piece.tolist()[0] for piece in pieces(numbers)] == [0, 10, 20, 30]
    assert gone == [35] * 4

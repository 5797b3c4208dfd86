"""What episode files keep of boxes and bots."""

from types import SimpleNamespace

import numpy as np

from racecraft.worlds.deepracer.training.recorder import _by_name, places_of_objects


def course(worlds, count):
    boxes = np.arange(worlds * count * 6, dtype=float).reshape(worlds, count, 6)
    return SimpleNamespace(seen_boxes=boxes)


def test_places_are_those_of_the_boxes():
    one = course(2, 3)
    assert np.array_equal(places_of_objects(one), one.seen_boxes[..., :3].astype(np.float32))
    assert places_of_objects(course(2, 0)).size == 0


def test_a_record_names_every_box(monkeypatch):
    places = np.arange(2 * 4 * 2 * 3, dtype=np.float32).reshape(2, 4, 2, 3)
    records = _by_name(places)
    assert records.dtype.names == ("x_0", "y_0", "yaw_0", "x_1", "y_1", "yaw_1")
    assert records.shape == (8,)
    assert records["x_1"].tolist() == places[:, :, 1, 0].reshape(-1).tolist()
    assert records["yaw_0"].tolist() == places[:, :, 0, 2].reshape(-1).tolist()


def test_courses_with_fewer_boxes_have_gaps(monkeypatch):
    import racecraft.worlds.deepracer.training.recorder as recorder

    several = SimpleNamespace(courses=(course(1, 2), course(2, 0), course(1, 1)))
    monkeypatch.setattr(recorder, "MultiCourseWorld", SimpleNamespace)
    places = places_of_objects(several)
    assert places.shape == (4, 2, 3)
    assert np.isnan(places[..., 0]).tolist() == [[False, False], [True, True], [True, True], [False, True]]

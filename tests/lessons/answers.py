"""Answers to the exercises: right ones, one for each misconception, and random ones. By "lesson/exercise".

`RIGHT` passes; `CASES` fails with the feedback of its case; what is a figure's is written as the figure gives it.
"""

ROAD = {"columns": 7, "pays": "centre", "moves": "ahead", "changed": []}


def drive(*moves, **road):
    return {"drive": {"grid": ROAD | road, "moves": list(moves)}}


RIGHT = {
    "grid/early-drive": drive(1, 0, 1, 0),
    "grid/best-drive": drive(1, 1, 1, 1, 1, 1),
    "grid/last-values": {"last": "2", "before": "3.8"},
    "grid/three-drives": {"last": "1.75", "start": "2,8525"},
    "grid/turn-an-arrow": {"grid": ROAD | {"changed": [[1, 3, 2.1]]}},
}
CASES = {
    "grid/early-drive": {
        "not_ended": drive(1),
        "too_much": drive(1, 1, 0, 0),
        "too_little": drive(0, 0),
        "other_grid": drive(1, 0, 1, 0, changed=[[2, 1, 3.0]]),
    },
    "grid/best-drive": {
        "left_road": drive(1, 0, 1, 0),
        "stayed": drive(1, 1, 1, 1, 1, 0),
        "not_ended": drive(1, 1),
        "other_grid": drive(1, 1, 1, 1, 1, 1, changed=[[2, 1, 3.0]]),
    },
    "grid/last-values": {
        "only_reward": {"last": "2", "before": "2"},
        "no_discount": {"last": "2", "before": "4"},
        "last_wrong": {"last": "3", "before": "3.8"},
        "before_wrong": {"last": "2", "before": "9"},
    },
    "grid/three-drives": {
        "whole_step": {"last": "2", "start": "2.8525"},
        "last_wrong": {"last": "0.5", "start": "2.8525"},
        "same_everywhere": {"last": "1.75", "start": "1.75"},
        "start_wrong": {"last": "1.75", "start": "9"},
    },
    "grid/turn-an-arrow": {
        "nothing_changed": {"grid": ROAD},
        "more_than_needed": {"grid": ROAD | {"changed": [[1, 3, 2.5]]}},
        "several": {"grid": ROAD | {"changed": [[1, 3, 9], [1, 4, 9]]}},
        "still_straight": {"grid": ROAD | {"changed": [[1, 3, 0.4]]}},
    },
}


def random_take(exercise, name, rng):
    """Return what a figure gives after somebody played with it at random."""
    road = dict(ROAD)
    if name == "grid":
        road["changed"] = [
            [rng.randrange(1, 4), rng.randrange(6), round(rng.uniform(-4, 4), 1)] for _ in range(rng.randint(0, 3))
        ]
        return road
    return {"grid": road, "moves": [rng.randrange(3) for _ in range(6)]}

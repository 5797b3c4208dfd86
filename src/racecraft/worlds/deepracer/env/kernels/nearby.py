"""What is near each car of a world: its world's objects, and other cars as boxes. Begin at `collect_nearby`.

A car alone finds the objects themselves (`objects.Nearby` is then a view of them) and nothing is done here.
"""

from __future__ import annotations

from racecraft.kernels import kernel
from racecraft.worlds.deepracer.env.kernels.objects import note_place


@kernel
def collect_nearby(track, objects, cars, around, n):
    """Write down, for every car of world n, the world's objects and behind them the other cars in their order.

    A car that is parked is carried off the road: nobody finds it.
    """
    count = cars.shape[1]
    if count == 1:
        return
    for m in range(count):
        if not cars[n, m].away:
            note_car(track, cars[n, m], around.bodies[n, m], around.body_states[n, m])
    num_objects = objects.boxes.shape[1]
    for m in range(count):
        found = num_objects
        for k in range(num_objects):
            around.boxes[n, m, k] = objects.boxes[n, k]
            around.states[n, m, k] = objects.states[n, k]
        for other in range(count):
            if other != m and not cars[n, other].away:
                around.boxes[n, m, found] = around.bodies[n, other]
                around.states[n, m, found] = around.body_states[n, other]
                found += 1
        around.counts[n, m] = found


@kernel
def note_car(track, car, box, state):
    """Write down a car as others find it; its size stands in the box already."""
    box[0], box[1], box[2] = car.x, car.y, car.yaw
    note_place(track, box, state)
    state.driven, state.speed, state.pause = car.arc, car.speed, float(car.held)

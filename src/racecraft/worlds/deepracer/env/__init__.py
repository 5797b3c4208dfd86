"""Cars with cameras on tracks: the world DeepRacer agents learn in.

Begin in `race.py`; it tells one tick of a race in order.

    race.py           one tick: report the moment, call endings, drive, locate, look, restart
    vehicle.py        how the car answers steering and throttle
    camera.py         what the car sees
    scene.py          the ground, its lines and walls, as the camera needs them
    actions.py        what a car can be told
    reward_params.py  the dictionary handed to a user's reward_function
    reward_process.py the user's reward_function in a process of its own
    world.py          N cars as a World; its card
    kernels/          the bodies of the above, compiled

Metres, seconds, radians; x east, y north; a positive angle turns left. This package knows nothing of learning, jobs or
screens.
"""

"""What worlds, policies and learners promise each other, with the tests of a world. Begin with `world.py`.

    world.py           what a step is, and whose arrays it writes into
    policy.py          from observations to actions
    conformance.py     the tests that every world passes
    random_streams.py  random numbers that depend neither on threads nor on the number of worlds
    errors.py          all errors

This package knows no world, no algorithm and no file.
"""

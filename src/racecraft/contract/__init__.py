"""What a world and a policy promise each other, and the exam that holds them to it.

    world.py           what a step is, and whose arrays it writes into
    policy.py          from observations to actions
    conformance.py            the examination every world sits
    random_streams.py  chance that depends on neither threads nor neighbours
    errors.py          the family of errors

This room knows no particular world, no algorithm and no file.
"""

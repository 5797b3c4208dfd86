"""Worlds that live in another program: Unity scenes that speak ML-Agents' protocol, without ML-Agents' own package.

Begin in ``session.py``: one player, connected; its ``reset`` and ``step`` are the whole conversation.

    wire.py           the gRPC server that a player talks to, on loopback, with a free port
    behaviors.py      what an agent sees and does: sensors, action specs, pictures
    side_channels.py  engine settings, environment parameters, statistics: bytes beside the steps
    builds.py         where a player comes from: a path, `registry:NAME`, `editor`, `builtin:Basic`
    process.py        the player's process: started, watched, its log read, its whole group ended
    session.py        one conversation with one player
    world.py          our World over any number of players
    choosing.py       which of a scene's behaviors are acted for
    restarts.py       how often a lost player is started anew
    rows.py           who sits in which row of that World
    joint_rows.py        several behaviors of a scene in one World
    behavior_specs.py          behaviors in a checkpoint's card, and back
    actions.py        Unity's branches and numbers as one action of our contract
    gymnasium_env.py  Gymnasium's Env and VectorEnv over that World
    parallel.py       PettingZoo's ParallelEnv, for scenes with several behaviors
    trainer_options.py  `mlagents-learn`'s configuration as arguments of that World
    player.py         the other side of the wire, for stand-ins and tests
    basic_scene.py    a headless stand-in of ML-Agents' Basic scene, a program of its own
    errors.py         what can go wrong, each with what to do

Figures and field numbers come from the facts gathered on ML-Agents (packages 1.x to 4.x, wire versions 1.0 to 1.5).
This package knows nothing of learning. It needs the extra `racecraft[unity]`.
"""

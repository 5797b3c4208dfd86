"""The ids of our worlds at Gymnasium.

Gymnasium knows an id once its package was imported: `import racecraft.adapters` registers ours, and so does
`gymnasium.make("racecraft.adapters:racecraft/DeepRacer-v0")` in one line. This is the one import in the house that
does something; it writes names into Gymnasium's table and loads no world.
"""

from __future__ import annotations

import gymnasium


def register_envs() -> None:
    """Register the ids; doing so twice is doing so once."""
    if "racecraft/DeepRacer-v0" not in gymnasium.registry:
        gymnasium.register(
            id="racecraft/DeepRacer-v0",
            entry_point="racecraft.worlds.deepracer.adapter:DeepRacerEnv",
            vector_entry_point="racecraft.worlds.deepracer.adapter:deepracer_vector_env",
        )
    if "racecraft/Battlesnake-v0" not in gymnasium.registry:
        gymnasium.register(
            id="racecraft/Battlesnake-v0",
            entry_point="racecraft.worlds.battlesnake.players.gymnasium_env:SnakeEnv",
            vector_entry_point="racecraft.worlds.battlesnake.players.gymnasium_env:snake_vector_env",
        )
    if "racecraft/Unity-v0" not in gymnasium.registry:
        gymnasium.register(
            id="racecraft/Unity-v0",
            entry_point="racecraft.worlds.unity.env.gymnasium_env:unity_env",
        )

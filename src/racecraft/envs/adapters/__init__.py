"""Adapters: any Gymnasium environment as a world, and our worlds as others like to see them.

    from_gymnasium.py       a Gymnasium environment's id -> our World, N copies side by side
    gymnasium_env.py        World of one car    -> gymnasium.Env
    gymnasium_vector.py     World               -> gymnasium.vector.VectorEnv
    sb3_vec_env.py          World               -> Stable-Baselines3 VecEnv (extra `sb3`)
    pettingzoo_parallel.py  World of M agents   -> PettingZoo ParallelEnv (needs `pettingzoo`)
    spaces.py               our specs as Gymnasium spaces, for the four above
    deepracer_env.py        a car by its Gymnasium id, with a picture for people
    battlesnake_v0.py       Battlesnake as a PettingZoo environment, all seats open
    registry.py             the ids of our worlds; importing this room registers them at Gymnasium

All but the last three are generic and know no particular world.
"""

from racecraft.envs.adapters.registry import register_envs

register_envs()

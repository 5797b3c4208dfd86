"""Adapters: how Gymnasium, PettingZoo and Stable-Baselines3 see any world.

    gymnasium_env.py        World of one car    -> gymnasium.Env
    gymnasium_vector.py     World               -> gymnasium.vector.VectorEnv
    sb3_vec_env.py          World               -> Stable-Baselines3 VecEnv (extra `sb3`)
    pettingzoo_parallel.py  World of M agents   -> PettingZoo ParallelEnv (needs `pettingzoo`)
    spaces.py               our specs as Gymnasium spaces, for the four above
    registry.py             the ids of our worlds; importing this room registers them at Gymnasium

A car and a snake game by their ids stand in `worlds/deepracer/adapter.py` and `worlds/battlesnake/adapter.py`.
"""

from racecraft.adapters.registry import register_envs

register_envs()

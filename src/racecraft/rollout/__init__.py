"""Carries policies through many worlds at once and keeps what happened. Begin in `collector.py`.

collector.py       worlds and minds meet: a tick, told in order; horizon or whole episodes
rollout_buffer.py  storage that the worlds write into, tick by tick
statistics.py      episodes counted and summed up
"""

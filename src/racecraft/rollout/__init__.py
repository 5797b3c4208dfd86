"""Carries policies through many worlds at once and keeps what happened. Begin in `collector.py`.

collector.py     worlds and actors meet: a tick, told in order; horizon or whole episodes
trajectories.py  storage that the worlds write into, tick by tick
replay.py        what is remembered, for learners that draw from it again and again
                 (transition_ring.py stores it, priorities.py weighs it, kernels/ has the sum tree)
episodes.py      let a policy play whole episodes: the only such runner
memory.py        a learner's memory, where it is finite
statistics.py    episodes counted and summed up
settings.py      how experience is gathered
"""

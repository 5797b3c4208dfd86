"""racecraft: train, watch, judge, explain, race and ship reinforcement-learning agents on your own machine.

The rooms stand on floors, and a room opens doors only downward; ARCHITECTURE.md draws the house.
"""

__version__ = "0.1.0"

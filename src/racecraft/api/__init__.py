"""The public Python surface, behind `import racecraft as rc`: one short page a verb.

training.py  train and resume, in any kind of world
judging.py   judge a run
tuning.py    look for settings: a search, or a population
worlds.py    a world to step by hand
runs.py      what a run left, as tables; its policy by itself
"""

from racecraft.api.judging import evaluate
from racecraft.api.runs import Run, load_policy, read_run
from racecraft.api.training import resume, train
from racecraft.api.tuning import train_population, tune
from racecraft.api.worlds import make_world

__all__ = ["Run", "evaluate", "load_policy", "make_world", "read_run", "resume", "train", "train_population", "tune"]

"""Judge policies and compare trainings, whatever the world. Begin with `evaluate_run.py`.

A world brings its own evaluator through its kind; ratings, statistics over seeds and verdicts are made here.
"""

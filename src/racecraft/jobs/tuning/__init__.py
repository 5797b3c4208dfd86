"""Search for settings: many trainings, each with values of its own, the better half followed up.

    space.py             what may be varied, and within which bounds
    study.py             the only importer of Optuna: what is tried next, what is given up, what mattered
    search.py            the loop: begin trials, look after them, give up the hopeless ones
    training_trials.py   a trial is a training command of ours, run as a job
    population.py        population-based training: rounds, and the bad ones take over from the good
    population_trials.py a member's round is a training command of ours, run as a job

Begin with `search.py`.
"""

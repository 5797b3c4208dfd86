"""The reward laboratory: what a reward function pays for, before a training and after it.

    poses.py       poses and commands → the rows that a reward is asked about
    paying.py      many rows at once, in the limited process
    stock.py       laps and failed drives, from the fastest known to the clumsiest
    situations.py  two hundred moments to call it on
    units.py       slips of unit, from the text
    branches.py    branches that never run, from the text
    probes.py      slips of sign, one parameter changed at a time
    tricks.py      what pays more than lapping
    speed.py       whether fast laps or slow ones earn more
    ablation.py    lines without effect, and lines that drown others
    check.py       all of these
    pay_map.py     colour over the track
    rescore.py     laps of a log, paid again
    cases.py       the racer's own expectations
    lines_paid.py  which lines paid, and where

Begin with `check.check_reward`.
"""

"""Train a car. Begin in `trainer.py`.

plan.py              what was asked, made definite
presets.py           which settings it runs with
race_environment.py  what a run.env means
courses.py           where cars of one training drive differently
groups.py            the same as it is typed; hold_out.py: tracks that are only judged on
race_rules.py        what it says of judging
model_folder.py      a racer's folder
evaluator.py         five starts
recorder.py          every tick, for the episode files
weight_transfer.py   weights of an older run
aws/                 the same as AWS's files
"""

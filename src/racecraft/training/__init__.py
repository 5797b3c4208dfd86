"""The loop, and what surrounds it.

car_plan.py      what was asked, made definite
racing.py        train a car, or resume one
run_up.py        the common way to the loop, for worlds without files of a racer's
gym_training.py  any Gymnasium environment
unity_training.py, unity_plan.py, unity_settling.py, unity_judges.py    Unity scenes
restoring.py     a broken-off run goes on
loop.py          collect, learn, judge, keep
stopping.py      when it ends            presets.py    which settings it runs with
keeping.py       what it leaves          recorder.py   every tick, for the episode files
aws_files.py     the same as AWS files   cloning.py    weights of an older run
car_judge.py     five starts             gallery.py    film, path, curves
progress.py      what one sees           events.py     what watchers are told
"""

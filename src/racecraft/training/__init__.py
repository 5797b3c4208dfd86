"""The loop, and what surrounds it.

car_plan.py      what was asked, made definite
racing.py        train a car, or resume one
gym_training.py  the same loop for any Gymnasium environment
loop.py          collect, learn, judge, keep
stopping.py      when it ends            presets.py    which settings it runs with
keeping.py       what it leaves          recorder.py   every tick, for the episode files
aws_files.py     the same as AWS files   cloning.py    weights of an older run
car_judge.py     five starts             gallery.py    film, path, curves
progress.py      what one sees           events.py     what watchers are told
"""

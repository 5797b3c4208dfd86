"""AWS's comparison of snakes, made again: four runs over the old one, at equal wall-clock. Begin with `comparison.py`.

rows.py        what is trained, and with which settings
comparison.py  one training after the other, judged over whole games; what is finished is kept
"""

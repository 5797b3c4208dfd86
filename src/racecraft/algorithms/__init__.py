"""How minds improve: one algorithm, one page. Begin in `ppo.py`.

    ppo.py            proximal policy optimisation: act, then learn from what was kept
    experience.py     what was kept, as the learner reads it
    returns.py        advantages and value targets; the two endings kept apart
    networks.py       from named observations to action numbers and a value
    distributions.py  from action numbers to chosen actions and their likelihood
    weights.py        between torch and the files

This room knows no particular world and no file. It is where torch comes in.
"""

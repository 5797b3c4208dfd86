"""Arenas: snakes that join and leave, their games, and their ratings. Begin with `arena.py`.

    arena.py     plays the most informative games, one after the other
    terms.py     what an arena plays, and who takes part in it
    store.py     one SQLite file that holds all of it
    entry.py     admits a player: finds it, records its version, recognises it later
    spsa.py      weights of search, tuned by playing
    ladder.py    ratings on the anchors' scale, and who met whom

An arena is one file, so that it can be copied and kept. One process at a time writes games; reading is always possible.
"""

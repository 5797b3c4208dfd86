"""Arenas that last: snakes that come and go, their games, and what they are worth. Begin in `arena.py`.

    arena.py     plays the most informative meetings, one after the other, for as long as one likes
    terms.py     what an arena plays, and who takes part in it
    store.py     one SQLite file that holds all of it
    entry.py     a player let in: found, pinned to what it is today, known again later
    pairing.py   who should meet next
    gauntlet.py  weights of search, tuned by playing
    ladder.py    ratings on the anchors' scale, and who met whom

An arena is one file, so that it can be copied, mailed and kept. Games are written by one process at a time; players are
let in and out, and everything is read, at any time and by anybody.
"""

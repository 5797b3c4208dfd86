"""Worlds carried by workers in other processes, on this machine or on many. Begin with `distribute.py`.

cluster_options.py          what `--cluster` was given: N, auto, HOST:PORT
shares.py         which worker carries which worlds, with which chance
messages.py       what passes between the training and a worker
worker.py         worlds and an actor, in a process of its own
transport.py      how workers are reached, as the rest of the package sees it
deadlines.py       how long something is waited for
worker_pool.py           workers in their places; one that is lost is replaced, and what it was at is done again
collector.py      collects by workers, as the loop expects of any collector
ray_transport.py  the only importer of Ray
"""

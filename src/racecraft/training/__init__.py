"""Train: request → plan → experiment → loop → run folder, for every world. Begin with `trainer.py`, then `loop.py`.

`worlds.py` finds the world of a request, `plain.py` trains in worlds that bring nothing but themselves, `stopping.py`
ends a training, `resume.py` takes one up again, `run_writer.py` leaves what it comes to.
"""

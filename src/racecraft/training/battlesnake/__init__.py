"""Train a snake by self-play. Begin in `trainer.py`.

self_play.py  games as rows of the learner's seats
evaluator.py  a rating against the anchors
"""

"""Train a snake by self-play. Begin in `trainer.py`.

self_play.py  games as rows of the learner's seats
foreign_seats.py  snakes from elsewhere that are met there
searched_play.py  the same games, each position searched; symmetries.py: every position is eight
evaluator.py  a rating against the anchors
"""

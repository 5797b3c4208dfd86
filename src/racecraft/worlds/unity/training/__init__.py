"""Train in Unity scenes. Begin in `trainer.py`.

plan.py       what was asked, made definite
resolve_settings.py   what only the scene could tell
evaluator.py  who says how good a policy is
"""

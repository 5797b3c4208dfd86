"""Train on any registered Gymnasium environment: `trainer.py`."""

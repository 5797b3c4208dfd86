"""The verbs of Gymnasium's environments."""

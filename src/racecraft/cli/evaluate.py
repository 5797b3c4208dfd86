"""`racecraft evaluate`: judge a trained car."""


def evaluate() -> None:
    """Judge a trained car."""

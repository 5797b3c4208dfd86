"""`IPython`, as far as notebooks import it where none is installed: what shows things, in `IPython.display`."""

version_info = (9, 0)
"""Asked by matplotlib, which then looks for `get_ipython`."""


def get_ipython() -> None:
    """Return that there is no IPython, to those who ask before they hook themselves into it."""


__all__ = ["get_ipython", "version_info"]

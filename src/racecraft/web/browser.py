"""Open a page in the user's browser."""

from __future__ import annotations

import threading
import webbrowser


def open_page(address: str) -> None:
    """Open a page aside: a browser of the terminal keeps its caller waiting until it is closed."""
    threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

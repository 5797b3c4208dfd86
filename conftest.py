"""Before anything is imported: threads that wait shall soon sleep, as the command line has it (see `cli/app.py`).

Processes that tests spawn shall find `tests` too, be it `pytest` that was typed or `python -m pytest`.

And Ctrl-C shall reach the programs that tests start: a suite that a shell began in the background ignores it, and so
would they.
"""

import os
import signal
import sys
from pathlib import Path

os.environ.setdefault("GOMP_SPINCOUNT", "2000")
if (root := str(Path(__file__).parent)) not in sys.path:
    sys.path.insert(0, root)
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

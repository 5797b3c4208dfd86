"""Before anything is imported: threads that wait shall soon sleep, as the command line has it (see `cli/app.py`).

And Ctrl-C shall reach the programs that tests start: a suite that a shell began in the background ignores it, and so
would they.
"""

import os
import signal

os.environ.setdefault("GOMP_SPINCOUNT", "2000")
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

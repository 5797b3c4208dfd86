"""Before anything is imported: threads that wait shall soon sleep, as the command line has it (see `cli/app.py`)."""

import os

os.environ.setdefault("GOMP_SPINCOUNT", "2000")

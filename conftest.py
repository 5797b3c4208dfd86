"""Before anything is imported: threads that wait shall sleep, as the command line has it (see `cli/app.py`)."""

import os

os.environ.setdefault("OMP_WAIT_POLICY", "passive")

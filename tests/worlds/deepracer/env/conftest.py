"""The slow references of `tests/` are shared by several rooms' tests."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[3]))

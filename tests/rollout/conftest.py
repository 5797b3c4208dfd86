"""The toy worlds of `tests/contract/toy_world.py` are shared by several rooms' tests."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "contract"))

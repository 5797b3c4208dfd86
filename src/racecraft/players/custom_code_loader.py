"""A run's own code, for as long as its policy is made: what the user wrote, as it was when the training began.

`code/` holds it where a network or an algorithm is the user's own (`training/custom_code.py`). It is run by whatever
makes the policy of that run, as `racecraft evaluate` does, and by nothing else: reading or opening a run runs nothing.
"""

from __future__ import annotations

import contextlib
import importlib
import sys
from collections.abc import Iterator

from racecraft.contract.loading import add_cwd_to_path, require_own_code
from racecraft.formats.run_folder import CODE, RunFolder


@contextlib.contextmanager
def own_code_of(run: RunFolder) -> Iterator[None]:
    """Have a run's own modules be found first; afterwards other modules of the same names are there again."""
    folder = run.path / CODE
    names = (
        {path.stem if path.suffix == ".py" else path.name for path in folder.iterdir()} if folder.is_dir() else set()
    )
    if not names:
        yield
        return
    require_own_code(f"{folder}: {', '.join(sorted(names))}")
    before = {name: sys.modules.pop(name) for name in list(sys.modules) if name.partition(".")[0] in names}
    add_cwd_to_path()  # now, for it would come first later
    place = str(folder.resolve())
    writes_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # a run is left as it was
    sys.path.insert(0, place)
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.dont_write_bytecode = writes_bytecode
        sys.path.remove(place)
        for name in [name for name in sys.modules if name.partition(".")[0] in names]:
            del sys.modules[name]
        sys.modules.update(before)

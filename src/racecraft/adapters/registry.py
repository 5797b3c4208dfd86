"""The ids of installed worlds at Gymnasium.

Gymnasium knows an id once its package was imported: `import racecraft.adapters` registers them, and so does
`gymnasium.make("racecraft.adapters:racecraft/DeepRacer-v0")` in one line. This import writes names into
Gymnasium's table and loads no world.
"""

from __future__ import annotations

import gymnasium

from racecraft.contract.kinds import kinds


def register_envs() -> None:
    """Register the ids of every kind of world that is installed; doing so twice is doing so once."""
    for kind in kinds():
        for name, (environment, vector) in kind.gymnasium_envs.items():
            if name not in gymnasium.registry:
                gymnasium.register(id=name, entry_point=environment, vector_entry_point=vector)

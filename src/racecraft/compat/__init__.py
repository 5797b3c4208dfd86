"""Foreign names for scripts that were written against other packages, on the path only inside `racecraft run SCRIPT`.

    shims.py   puts the names on the path and takes them off again; runs a script
    names/       one package for each name: `mlagents_envs`, `gym_unity` and a minimal old-style `gym`

Nothing here is importable under its foreign name outside `foreign_names()`.
"""

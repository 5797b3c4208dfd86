"""Files of our own, which strangers may read or take away. Begin with `run_folder.py`.

Reader and writer of a format stand together, with a test of both. Files are written whole or not at all, nothing read
here can run code, and numbers are metres, seconds and radians. Files of a world (AWS's, ML-Agents') are in that
world's `files/`. This package knows no world and no learner.
"""

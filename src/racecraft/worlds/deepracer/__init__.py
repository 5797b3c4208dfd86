"""Cars with cameras and LiDAR on tracks, and AWS's files. Begin with `kind.py`, then `env/race.py`.

files (AWS's formats) → tracks → env (physics, camera, rules in one compiled tick) → logs → players → evaluation →
driving (best known laps, telemetry, rewards) → analysis → training → export → cli.
"""

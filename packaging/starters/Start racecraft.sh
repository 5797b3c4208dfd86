#!/bin/sh
# Double-click, and choose "Run" where the file manager asks.
cd "$(dirname "$0")/parts" && exec ./python/bin/python3 begin.py "$@"

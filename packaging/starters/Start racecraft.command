#!/bin/sh
# Double-click. macOS asks once whether to open what was downloaded: right-click, Open.
cd "$(dirname "$0")/parts" && exec ./python/bin/python3 begin.py "$@"

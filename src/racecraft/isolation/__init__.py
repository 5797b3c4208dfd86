"""Code of others, in a process that can compute and nothing else. Begin with `layers.restrict`.

    layers.py     what a process gives up, step by step; which steps this kernel has
    landlock.py   no files but those that are named
    seccomp.py    no sockets, processes, programs or signals
    readable.py   which files the interpreter and its packages need
    channel.py    numbers between two processes: no pickle
    process.py    the process, seen from its owner, who keeps the clock
    worker.py     its other end: messages answered one after another

The process imports its code after it has given everything up. Nothing that comes back from it is trusted: sizes are
bounded, texts are JSON, numbers are bytes.
"""

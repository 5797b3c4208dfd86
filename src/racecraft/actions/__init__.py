"""The verbs: each a frozen request, a function and a frozen result. Begin with `action.py`.

`import racecraft as rc` and the command line are made from these; a world's own verbs stand in its package `actions`.
"""

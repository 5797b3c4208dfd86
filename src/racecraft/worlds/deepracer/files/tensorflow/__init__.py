"""TensorFlow's files without TensorFlow: graphs and checkpoints, read and written. Begin in `graph.py`.

    messages.py     the messages of the other files, as one table of fields
    tensors.py      an array in a message
    graph.py        a graph of named nodes: `model.pb`, and what a `.meta` file holds
    table.py        sorted tables of keys and values: what a `.index` file is
    checkpoint.py   named arrays: `.index` and `.data-00000-of-00001`
    arithmetic.py   what a graph computes, in NumPy

Everything read is a stranger's: sizes are checked before anything is made of them, and nothing that is read runs.
"""

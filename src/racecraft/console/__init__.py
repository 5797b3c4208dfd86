"""The console: a racer's models in a browser, on one's own machine. Begin with `workspace.py`, then `application.py`.

    workspace.py    a folder of models: each a racer's folder with its runs, tags and notes as files
    parts.py        what a world adds to the console's pages; what it need not add
    run_row.py      one run read into one row
    index.py        every model and run as rows of a database, made again from the folders when it is lost
    watcher.py      one thread that keeps the index current
    drafts.py       a model that is being made, kept as a file
    training.py     begin and end trainings, as jobs
    application.py  the pages and what answers for them

Everything the console shows lies in files, and everything it does is a command as well.
"""

"""Trainings that outlive the terminal they were begun in. Begin with `submit.py`, then `supervisor.py`.

    states.py       the map of a job's life, in SageMaker's words
    job.py          one job as it stands, and every legal change of it
    store.py        what a store of jobs promises; one in memory
    sql_store.py    jobs in a database: a SQLite file, or any other that SQLAlchemy knows
    job_paths.py         where the jobs of this account lie: store, logs, folders
    submit.py       put a job into the store, and see to it that somebody works there
    supervisor.py   takes jobs, starts them, restarts what a signal ended, queues the rest
    supervisor_start.py       start a supervisor where there is none
    preload.py        a process that imports while the command that begins its job still reads
    children.py     a job's process, and how it dies with its supervisor
    parent_watch.py     the other end of that, in the job's process
    capacity.py     cores and memory of this machine
    follow.py       a job's log as it grows
    metrics.py      figures read out of a log, as series

A job is a command of racecraft's. It knows other packages only by the words of that command, and of what was trained
only by its run folder.
"""

"""Databases by SQLAlchemy Core: SQLite unless another address is named. Begin with `engine.py`.

Whatever can be made again from files is made again from files; a database that is lost loses no run.
"""

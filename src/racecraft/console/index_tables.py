"""The tables of the index: one row a model, one row a run, and the version of both. They hold nothing of their own."""

from __future__ import annotations

import sqlalchemy as sql

VERSION = 2
"""Another version's tables are dropped and filled again from the folders."""

TABLES = sql.MetaData()

ABOUT = sql.Table(
    "console_about",
    TABLES,
    sql.Column("name", sql.String(32), primary_key=True),
    sql.Column("value", sql.Text, nullable=False),
)
"""The version, and the workspace the rows are of."""

MODELS = sql.Table(
    "console_models",
    TABLES,
    sql.Column("name", sql.String(64), primary_key=True),
    sql.Column("owner", sql.String(64), nullable=False, server_default=""),
    sql.Column("path", sql.Text, nullable=False),
    sql.Column("run", sql.Text, nullable=False),
    sql.Column("status", sql.String(16), nullable=False, index=True),
    sql.Column("reason", sql.Text, nullable=False),
    sql.Column("job", sql.String(64), nullable=False),
    sql.Column("kind", sql.String(32), nullable=False),
    sql.Column("algorithm", sql.String(64), nullable=False),
    sql.Column("place", sql.String(128), nullable=False, index=True),
    sql.Column("picture", sql.String(128), nullable=False),
    sql.Column("about", sql.Text, nullable=False),
    sql.Column("rank", sql.Float(53), index=True),
    sql.Column("best_text", sql.String(64), nullable=False),
    sql.Column("gap_percent", sql.Float(53)),
    sql.Column("curve", sql.JSON, nullable=False),
    sql.Column("iterations", sql.Integer, nullable=False),
    sql.Column("steps", sql.BigInteger, nullable=False),
    sql.Column("seconds", sql.Float(53), nullable=False),
    sql.Column("speed", sql.Float(53)),
    sql.Column("stops", sql.JSON, nullable=False),
    sql.Column("runs", sql.Integer, nullable=False),
    sql.Column("changed", sql.Float(53), nullable=False, index=True),
    sql.Column("archived", sql.Boolean, nullable=False, index=True),
    sql.Column("tags", sql.JSON, nullable=False),
    sql.Column("cloned_from", sql.String(128), nullable=False),
    sql.Column("text", sql.Text, nullable=False),
    sql.Column("search", sql.Text, nullable=False),
)

RUNS = sql.Table(
    "console_runs",
    TABLES,
    sql.Column("path", sql.String(512), primary_key=True),
    sql.Column("owner", sql.String(64), nullable=False, server_default=""),
    sql.Column("row", sql.JSON, nullable=False),
)
"""`row` is a `RunRow`."""

"""The tables of accounts; `database/migrations` makes them."""

from __future__ import annotations

import sqlalchemy as sql

TABLES = sql.MetaData()

PEOPLE = sql.Table(
    "racecraft_people",
    TABLES,
    sql.Column("id", sql.String(16), primary_key=True),
    sql.Column("name", sql.String(64), nullable=False),
    sql.Column("name_key", sql.String(128), nullable=False, unique=True),
    sql.Column("role", sql.String(16), nullable=False),
    sql.Column("password", sql.Text, nullable=False),
    sql.Column("created", sql.Float(53), nullable=False),
)
"""`password` is Argon2's hash; "": the invitation was not accepted yet."""

INVITATIONS = sql.Table(
    "racecraft_invitations",
    TABLES,
    sql.Column("token", sql.String(64), primary_key=True),
    sql.Column("person", sql.String(16), nullable=False),
    sql.Column("created", sql.Float(53), nullable=False),
    sql.Column("ends", sql.Float(53), nullable=False),
)
"""`token` is the SHA-256 of what the link holds; a person has one link at most, and it is deleted when it is used."""

SESSIONS = sql.Table(
    "racecraft_sessions",
    TABLES,
    sql.Column("token", sql.String(64), primary_key=True),
    sql.Column("session", sql.String(32), nullable=False),
    sql.Column("person", sql.String(16), nullable=False),
    sql.Column("began", sql.Float(53), nullable=False),
    sql.Column("issued", sql.Float(53), nullable=False),
    sql.Column("ends", sql.Float(53), nullable=False),
)
"""One row a token; a session has two while an old one is replaced. `token` is the SHA-256 of what the cookie holds."""

ACTS = sql.Table(
    "racecraft_acts",
    TABLES,
    sql.Column("number", sql.Integer, primary_key=True, autoincrement=True),
    sql.Column("time", sql.Float(53), nullable=False),
    sql.Column("person", sql.String(16), nullable=False),
    sql.Column("name", sql.String(64), nullable=False),
    sql.Column("what", sql.String(64), nullable=False),
    sql.Column("subject", sql.String(128), nullable=False),
    sql.Column("detail", sql.Text, nullable=False),
)
"""What owners and organisers did; rows are added and never changed."""

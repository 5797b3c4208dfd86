"""People, their invitations and sessions, and the log of what organisers did."""

import sqlalchemy as sql
from alembic import op

revision, down_revision = "0003", "0002"


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "racecraft_people",
        sql.Column("id", sql.String(16), primary_key=True),
        sql.Column("name", sql.String(64), nullable=False),
        sql.Column("name_key", sql.String(128), nullable=False, unique=True),
        sql.Column("role", sql.String(16), nullable=False),
        sql.Column("password", sql.Text, nullable=False),
        sql.Column("created", sql.Float(53), nullable=False),
    )
    op.create_table(
        "racecraft_invitations",
        sql.Column("token", sql.String(64), primary_key=True),
        sql.Column("person", sql.String(16), nullable=False, index=True),
        sql.Column("created", sql.Float(53), nullable=False),
        sql.Column("ends", sql.Float(53), nullable=False),
    )
    op.create_table(
        "racecraft_sessions",
        sql.Column("token", sql.String(64), primary_key=True),
        sql.Column("session", sql.String(32), nullable=False, index=True),
        sql.Column("person", sql.String(16), nullable=False, index=True),
        sql.Column("began", sql.Float(53), nullable=False),
        sql.Column("issued", sql.Float(53), nullable=False),
        sql.Column("ends", sql.Float(53), nullable=False),
    )
    op.create_table(
        "racecraft_acts",
        sql.Column("number", sql.Integer, primary_key=True, autoincrement=True),
        sql.Column("time", sql.Float(53), nullable=False),
        sql.Column("person", sql.String(16), nullable=False),
        sql.Column("name", sql.String(64), nullable=False),
        sql.Column("what", sql.String(64), nullable=False),
        sql.Column("subject", sql.String(128), nullable=False),
        sql.Column("detail", sql.Text, nullable=False),
    )

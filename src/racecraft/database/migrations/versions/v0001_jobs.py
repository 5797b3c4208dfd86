"""The table of jobs as racecraft first had it; a database that holds it already keeps it."""

import sqlalchemy as sql
from alembic import op

revision, down_revision = "0001", None


def upgrade() -> None:
    """Make the table where there is none."""
    op.create_table(
        "racecraft_jobs",
        sql.Column("name", sql.String(63), primary_key=True),
        sql.Column("created", sql.Float(53), nullable=False),
        sql.Column("state", sql.String(32), nullable=False),
        sql.Column("revision", sql.Integer, nullable=False),
        sql.Column("told", sql.Text, nullable=False),
        if_not_exists=True,
    )
    op.create_index("ix_racecraft_jobs_created", "racecraft_jobs", ["created"], if_not_exists=True)

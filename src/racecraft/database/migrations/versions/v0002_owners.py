"""Every job has an owner, "" for the only user of a machine; the table that held a version of its own goes."""

import sqlalchemy as sql
from alembic import op

revision, down_revision = "0002", "0001"


def upgrade() -> None:
    """Add the owner."""
    op.add_column("racecraft_jobs", sql.Column("person", sql.String(64), nullable=False, server_default=""))
    op.create_index("ix_racecraft_jobs_state", "racecraft_jobs", ["state"], if_not_exists=True)
    op.drop_table("racecraft_store", if_exists=True)

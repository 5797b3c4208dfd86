"""Alembic's own entry: run the versions beside this file on the connection that `database/migrate.py` hands over."""

from alembic import context

context.configure(connection=context.config.attributes["connection"], transactional_ddl=False)
context.run_migrations()

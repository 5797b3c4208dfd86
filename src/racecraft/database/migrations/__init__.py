"""Changes of the tables, oldest first; `database/migrate.py` runs them."""

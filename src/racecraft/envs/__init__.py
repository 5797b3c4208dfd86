"""Worlds: what minds live in. Each room is a stranger to the others; `faces` shows them to other libraries."""

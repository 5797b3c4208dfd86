"""Servers for snakes: the webhook, the board, the arena."""

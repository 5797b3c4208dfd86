"""The verbs of snakes: each a frozen request, a function and a frozen result."""

"""The verbs of cars: each a frozen request, a function and a frozen result."""

"""The checks of the lessons, a module a lesson."""

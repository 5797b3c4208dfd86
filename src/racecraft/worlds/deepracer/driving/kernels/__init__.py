"""Compiled bodies of the planner."""

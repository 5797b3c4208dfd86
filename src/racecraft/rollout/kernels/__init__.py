"""Compiled bodies of the rollout's storage."""

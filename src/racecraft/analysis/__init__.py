"""Explain what happened, from the files alone: curves, a report, advice, attribution. Begin with `report.py`.

A world adds its own parts: `page_part.py`.
"""

"""What combines analysis and evaluation into pages and pictures of a run.

gallery.py   a film of the best lap, its path, the curves, the report
"""

"""Explains what happened, from the files alone: films, figures, tables, a report.

Begin with `drive.py`, the shape that films and pictures are made from. `write_video`, `draw_path`, `draw_curves` and
`write_report` make what one looks at; `tables.py` makes what one counts.
"""

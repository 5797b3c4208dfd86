"""Notebooks over local logs and runs. Begin with `write.py`; `cells.py` has what stands in them."""

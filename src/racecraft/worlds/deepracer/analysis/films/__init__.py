"""Films of drives from several cameras, with cars as simple solids. Begin with `film.py`."""

"""How pages and figures look, for files and servers alike."""

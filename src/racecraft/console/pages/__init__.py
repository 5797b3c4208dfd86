"""The console's pages: each function returns plain data, which a template draws and `.json` shows."""

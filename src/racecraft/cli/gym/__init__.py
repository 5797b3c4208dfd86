"""`racecraft gym`."""

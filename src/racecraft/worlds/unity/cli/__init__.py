"""`racecraft unity`."""

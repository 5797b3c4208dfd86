"""`racecraft people`."""

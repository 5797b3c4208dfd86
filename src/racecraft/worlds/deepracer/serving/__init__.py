"""What a car's run answers over HTTP."""

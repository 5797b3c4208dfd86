"""Hand a car's policy over: AWS's model folder, the archive of a physical car."""

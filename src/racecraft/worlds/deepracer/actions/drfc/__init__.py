"""What the commands of DeepRacer for Cloud do, on folders and jobs of this machine. Begin with `jobs.py`."""

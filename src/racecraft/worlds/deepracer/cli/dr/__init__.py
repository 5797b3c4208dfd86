"""`racecraft dr`: the commands of DeepRacer for Cloud, as bin/activate.sh calls them. Begin with `group.py`."""

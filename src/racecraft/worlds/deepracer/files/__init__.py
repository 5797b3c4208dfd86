"""Files of AWS DeepRacer and of DeepRacer for Cloud; reader and writer stand together."""

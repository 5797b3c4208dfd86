"""Cars explained: drives, maps of the track, the replay page."""

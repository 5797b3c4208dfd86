"""DeepRacer: cars with cameras and LiDAR on tracks, and everything that is about them."""

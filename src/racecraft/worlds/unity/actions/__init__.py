"""The verbs of Unity's scenes."""

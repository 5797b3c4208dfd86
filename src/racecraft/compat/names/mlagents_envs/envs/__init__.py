"""Faces of a Unity scene, where ML-Agents keeps them."""

"""Scalar bodies of the circuit's geometry; other kernels call them."""

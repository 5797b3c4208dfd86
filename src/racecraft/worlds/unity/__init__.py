"""Unity scenes over ML-Agents' protocol, and everything that is about them."""

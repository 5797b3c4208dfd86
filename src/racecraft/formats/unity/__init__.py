"""Files of ML-Agents: its trainer configuration."""

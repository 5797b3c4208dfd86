"""Whatever can act: a trained policy, and the car it was trained for."""

"""What the figures compute: worlds so small that numbers are exact. `modules/` has them in the browser."""

"""Commands for trainings that outlive their terminal."""

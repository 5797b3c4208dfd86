"""The lessons that need no world. Other parts of the course name their checks in the same way."""

from racecraft.lessons.exercises import family, gradient, grid_world, rewards

CHECKS = (family, gradient, grid_world, rewards)

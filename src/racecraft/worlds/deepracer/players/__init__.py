"""Drivers of cars: `trained_car.py` loads one from its run folder."""

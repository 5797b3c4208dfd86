"""The commands of racers: train, evaluate, replay, new, tracks."""

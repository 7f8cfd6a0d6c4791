"""Sweeps: a table of missions, a row each, over seeds and whatever else is varied."""

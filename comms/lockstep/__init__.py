"""Lockstep: a clock grants the next simulated time at which anything happens, on every bus alike."""

"""What is expected to be left of the risk at the mission's end, by all that is known so far."""

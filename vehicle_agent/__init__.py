"""The survey agent and the revisit agent."""

"""The front door: command line, scenarios, launcher, observer and results."""

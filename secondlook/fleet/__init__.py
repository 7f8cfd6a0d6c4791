"""From a scenario to a fleet: which nodes and processes it has, and what each is told."""

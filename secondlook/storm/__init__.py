"""Storms: any fleet and any swarm of faults, drawn from a number; what must hold all the same is looked for in the real
nodes, and a mission in which it does not is flown again, made small, and kept."""

"""By the wall clock: nodes act on receipt, and whoever misses something asks for it."""

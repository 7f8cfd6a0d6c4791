"""From hotspots to strips: where a second look is worth its time."""

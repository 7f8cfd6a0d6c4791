"""What a node must not forget: kept in a file before it is said, and taken up by whoever is started in its place."""

"""The sea: seabed, sonar, vehicle motion and truth."""

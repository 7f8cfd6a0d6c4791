"""A mission as files for a geographic information system: what was flown and found, and the residual risk."""

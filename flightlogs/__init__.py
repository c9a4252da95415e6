"""flightlogs."""

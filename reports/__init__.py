"""Pages and JSON from results."""

"""Where twin and recording differ: locate it, name the physics left out, show the fit improve."""

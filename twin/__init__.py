"""The electrochemical twin of a pack, its calibration, its damage and what it leaves out."""

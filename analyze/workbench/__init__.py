"""The `twin` command: replay a load, age a pack, calibrate, explain, prove."""

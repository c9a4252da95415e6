"""The `twin` command: replay a load, age a pack."""

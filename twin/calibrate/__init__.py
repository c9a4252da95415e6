"""From reference tests of a pack to the parameters of its cells."""

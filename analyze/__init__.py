"""The `analyze` command: the only package that opens paths, prints and exits."""

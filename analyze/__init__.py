"""The `analyze` command; beside `proof` the only package that opens a user's files and prints."""

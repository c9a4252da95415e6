"""Truths made by PyBaMM: a cell, a pack, its instruments, and an effect in them."""

"""Truths that were measured: recordings whose revealing channel is kept from the tool."""

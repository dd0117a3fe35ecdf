"""Alexiev (2021), statement by statement: one file a figure or a group of statements."""

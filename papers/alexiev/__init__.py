"""Alexiev (2021), statement by statement."""

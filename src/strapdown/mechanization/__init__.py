"""Strapdown mechanizations: one file each."""

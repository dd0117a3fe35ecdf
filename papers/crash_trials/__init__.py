"""Simulated crashes through the whole chain, compared with exact truth."""

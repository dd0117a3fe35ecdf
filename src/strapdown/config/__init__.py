"""Frozen specifications of runs: stored with every result, so that it can be run again."""

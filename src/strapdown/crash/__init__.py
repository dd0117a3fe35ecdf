"""Crash reconstruction: events, delta-V, direction of force, severity, path, and their bounds."""

"""Geodetic, Earth-centred and local coordinates."""

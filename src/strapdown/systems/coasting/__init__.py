"""Drift during a GNSS outage."""

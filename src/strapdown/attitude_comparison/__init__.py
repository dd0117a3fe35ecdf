"""Comparison of attitude algorithms: errors, costs, and the simplest that suffices."""

"""Error states of a mechanization, their covariance in several forms, and robust updates."""

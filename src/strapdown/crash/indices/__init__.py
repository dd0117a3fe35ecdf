"""Indices of crash severity from the vehicle's motion: ASI, THIV and PHD, OLC, OIV and ORA, HIC."""

"""The systems of the three papers, composed of the lower layers."""

"""How far it drifts when what aids it stays away."""

"""System C: one navigation pipeline for simulations, recorded logs and live samples."""

"""Public face of the Earth's kernels."""

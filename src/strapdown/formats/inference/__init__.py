"""Inference of a log's units, axes and clock from its numbers: one module per question."""

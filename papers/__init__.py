"""Three papers reproduced through the public API of strapdown: statements, figures, verdicts."""

"""Command line: thin wrappers of the public functions, with deferred heavy imports."""

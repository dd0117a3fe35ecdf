"""The systems of the three papers, as thin compositions of what stands below."""

"""Many runs of one configuration or over many logs, and the statistics of their results."""

"""What a sensor does and what can be known of it."""

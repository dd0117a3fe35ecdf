"""Digital filters: CFC classes, resampling, derivatives, delays between signals."""

"""Digital filters: CFC classes, resampling, derivatives, delays between signals.

Arrays in, arrays out; each tells what it does to noise and to time.
"""

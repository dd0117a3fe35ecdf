"""Translates the kernels to C and compiles them."""

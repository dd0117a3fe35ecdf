"""Public Python interface, exported by `strapdown`: tables, arrays and files in, data out."""

"""The Python front door: tables, arrays and files in, data out; `strapdown` exports all of it."""

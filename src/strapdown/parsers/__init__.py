"""Parsing of files by other people's libraries, in a process of its own.

HDF5, MATLAB, Parquet, archives, workbooks and logs of recorders are parsed by libraries, some in C,
that were not written for files which somebody prepared. One wrong byte can end a
process by a signal, fill the memory, or never return. `parse` therefore runs a function of this
package in another process, which has limits of memory and time that follow the size of the file,
can write nothing, and answers with plain arrays (`wire`). A failure there is a DataError that names
the file.

The functions are in modules by library: `hdf5`, `matlab`, `parquet`, `archives`, `workbooks`,
`recorders`, `bags`. They import little, so that the process starts in 0.1 s, and know neither
streams nor quantities: what arrays mean is decided by `formats`, in the caller's process.
"""

from strapdown.parsers.process import in_place, parse, start, start_for

__all__ = ["in_place", "parse", "start", "start_for"]

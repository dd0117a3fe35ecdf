"""The map of a studio: tiles of a local MBTiles or PMTiles file, each checked before it is sent."""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from strapdown.errors import DataError
from strapdown.formats.map_tiles import Tile, open_map

if TYPE_CHECKING:
    from strapdown.studio.app import Studio

#: Endings of maps that are looked for in the folder.
ENDINGS = (".pmtiles", ".mbtiles")
DEEPEST = 22


@dataclass
class Map:
    """A map file; it is opened for each tile, as another thread may ask for the next.

    Attributes
    ----------
    path : Path
    attribution : str
        As the file states it, in plain text.
    zooms : (int, int)
    """

    path: Path
    attribution: str
    zooms: tuple[int, int] = (0, DEEPEST)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def tile(self, zoom: int, column: int, row: int) -> Tile | None:
        """Return a tile; None if there is none, or it is damaged."""
        if not 0 <= zoom <= DEEPEST or not 0 <= column < 1 << zoom or not 0 <= row < 1 << zoom:
            return None
        # One at a time: memory for one directory of a hostile file.
        with self._lock, suppress(DataError), open_map(self.path) as opened:
            return opened.tile(zoom, column, row)
        return None

    def told(self) -> dict[str, Any]:
        """Return what the page needs to show it."""
        return {
            "tiles": "tiles/{z}/{x}/{y}",
            "min": self.zooms[0],
            "max": self.zooms[1],
            "attribution": self.attribution,
        }


def map_of(studio: Studio) -> Map | None:
    """Return the map that was named at the start, or the first of the folder; None without any."""
    paths = [studio.map_file] if studio.map_file is not None else []
    if not paths:
        paths = [Path(e.path) for e in studio.folder.entries() if e.name.lower().endswith(ENDINGS)]
    for path in sorted(paths):
        with suppress(OSError):
            about = path.stat()
            key = (path, about.st_mtime_ns, about.st_size)
            if studio.known_map[0] == key:
                return studio.known_map[1]
            with suppress(DataError), open_map(path) as opened:
                studio.known_map = (key, Map(path, opened.attribution, opened.zooms))
                return studio.known_map[1]
    return None

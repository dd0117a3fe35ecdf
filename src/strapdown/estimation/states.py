"""Names, units and places of the states of a filter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StateBlock:
    """States that belong together.

    Attributes
    ----------
    name : str
        ``gyro_bias``; unique in a layout.
    labels : tuple of str
        One a state: ``("x", "y", "z")``.
    unit : str
        ``rad/s``; of all of them.
    """

    name: str
    labels: tuple[str, ...]
    unit: str

    def __len__(self) -> int:
        return len(self.labels)


@dataclass(frozen=True)
class StateLayout:
    """Where each block stands in a state vector.

    Attributes
    ----------
    blocks : tuple of StateBlock

    Raises
    ------
    ConfigError
        Two blocks have one name.
    """

    blocks: tuple[StateBlock, ...]

    def __post_init__(self) -> None:
        names = [block.name for block in self.blocks]
        for name in names:
            if names.count(name) > 1:
                raise ConfigError(
                    "estimation.stands-twice-among-states", quantity="states", name=name
                )

    @cached_property
    def places(self) -> dict[str, slice]:
        """Place of each block, by name."""
        out: dict[str, slice] = {}
        at = 0
        for block in self.blocks:
            out[block.name] = slice(at, at + len(block))
            at += len(block)
        return out

    @cached_property
    def size(self) -> int:
        """Number of states."""
        return sum(len(block) for block in self.blocks)

    def __contains__(self, name: str) -> bool:
        return name in self.places

    def __getitem__(self, name: str) -> slice:
        """Place of a block; a `ConfigError` names those that there are."""
        if name not in self.places:
            raise ConfigError(
                "estimation.no-state", quantity="states", name=name, word=name, known=self.places
            )
        return self.places[name]

    def labels(self) -> Iterator[str]:
        """One name a state: ``gyro_bias_x``."""
        for block in self.blocks:
            for label in block.labels:
                yield f"{block.name}_{label}"

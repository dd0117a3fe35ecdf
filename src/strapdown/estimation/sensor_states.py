"""Sensor errors as filter states: coupling to rate and force, and their process models."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from strapdown.errors import ConfigError, check_choice
from strapdown.tables.checks import Array

#: First axis of a coupling: a constant part, and the parts per rate x, y, z and per force x, y, z.
COUPLING = 7


@dataclass(frozen=True, eq=False)
class SensorStates:
    """A block of k states of the sensors.

    Attributes
    ----------
    block : StateBlock
    sd : ndarray, (k,)
        At the start, in the unit of the block.
    gyro, accel : ndarray, (7, 3, k)
        Added to the measured rate and specific force in body axes, linear in both:
        ``(gyro[0] + sum rate_i gyro[1 + i] + sum force_i gyro[4 + i]) @ states``. Zero for states
        that only measurements see, such as a lever arm.
    correlation_time : float, s
        Of a first-order Gauss-Markov process; infinite for constants and random walks.
    drive : ndarray, (k,)
        White noise that drives them, as a density: unit/√s, so that a random walk has a variance
        of ``drive² t``; zero for constants.
    """

    block: StateBlock
    sd: Array
    gyro: Array
    accel: Array
    correlation_time: float
    drive: Array

    @property
    def decay(self) -> float:
        """One over the correlation time, 1/s."""
        return 0.0 if math.isinf(self.correlation_time) else 1.0 / self.correlation_time

    def named(self, name: str) -> SensorStates:
        """Return the same states under another name, as for two receivers with a lever arm each."""
        return replace(self, block=replace(self.block, name=name))


class Stacked(NamedTuple):
    """Blocks side by side.

    Attributes
    ----------
    gyro, accel : ndarray, (7, 3, k)
    gyro_terms, accel_terms : ndarray, (l, 4)
        Non-zero elements: first, second and third index, and value.
    decay : ndarray, (k,), 1/s
    drive : ndarray, (k,)
    sd : ndarray, (k,)
    """

    gyro: Array
    accel: Array
    gyro_terms: Array
    accel_terms: Array
    decay: Array
    drive: Array
    sd: Array


def stack(blocks: tuple[SensorStates, ...]) -> Stacked:
    """Stack blocks, as kernels take them."""
    size = sum(len(one.block) for one in blocks)
    gyro, accel = np.zeros((2, COUPLING, 3, size))
    decay, drive, sd = np.zeros((3, size))
    at = 0
    for one in blocks:
        end = at + len(one.block)
        gyro[:, :, at:end], accel[:, :, at:end] = one.gyro, one.accel
        decay[at:end], drive[at:end], sd[at:end] = one.decay, one.drive, one.sd
        at = end
    return Stacked(gyro, accel, _terms(gyro), _terms(accel), decay, drive, sd)


def _terms(coupling: Array) -> Array:
    places = np.argwhere(coupling)
    values = coupling[tuple(places.T)]
    return np.column_stack([places.astype(np.float64), values]).reshape(-1, 4)


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
        Unit of all states of the block, e.g. ``rad/s``.
    """

    name: str
    labels: tuple[str, ...]
    unit: str

    def __len__(self) -> int:
        return len(self.labels)


@dataclass(frozen=True)
class StateLayout:
    """Position of each block in a state vector.

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
        """Position of each block, by name."""
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
        """Position of a block; a `ConfigError` lists the existing ones."""
        check_choice("estimation.no-state", self.places, quantity="states", name=name)
        return self.places[name]

    def labels(self) -> Iterator[str]:
        """One name per state: ``gyro_bias_x``."""
        for block in self.blocks:
            for label in block.labels:
                yield f"{block.name}_{label}"

"""How a device reads its sensors: rate, units, axes, biases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from strapdown.tables.checks import Array


@dataclass(frozen=True)
class Channel:
    """Readings of one sensor.

    `unit`: of a reading, in words, `scale` of it: rad/s or m/s² each; of a magnetometer any, as
    only the direction and the ratio of its fields are used. `axis`, `sign`: axis of the sensor that
    points forward, right, down, 0 to 2, and its sign. `bias` ((3,), rad/s or m/s² or unit of the
    field): subtracted, forward, right, down. `matrix` ((3, 3)): what remains is multiplied by it,
    as by the soft iron of a magnetometer; None: by none.
    """

    unit: str
    scale: float = 1.0
    axis: Sequence[int] = (0, 1, 2)
    sign: Sequence[float] = (1.0, 1.0, 1.0)
    bias: Sequence[float] = (0.0, 0.0, 0.0)
    matrix: Sequence[Sequence[float]] | None = None

    def body(self, raw: Array, number: Any = np.float64) -> Array:
        """Numbers of the body, (n, 3), from raw readings, as the file computes them."""
        factors = np.array(self.sign, number) * number(self.scale)
        turned = factors * raw[:, list(self.axis)].astype(number) - np.array(self.bias, number)
        if self.matrix is None:
            return np.asarray(turned)
        x, y, z = turned.T
        m = np.array(self.matrix, number)
        return np.stack([m[i, 0] * x + m[i, 1] * y + m[i, 2] * z for i in range(3)], axis=1)

    def raw(self, body: Array) -> Array:
        """Readings of numbers of the body, (n, 3)."""
        if self.matrix is not None:
            body = np.linalg.solve(np.array(self.matrix), body.T).T
        out = np.empty_like(body)
        out[:, list(self.axis)] = (body + self.bias) * self.sign / self.scale
        return out

    def expressions(self, name: str, unit: str, literal: Callable[[float], str]) -> list[str]:
        """Numbers of the body, as C and Python write them, from a raw reading called `name`."""
        times = "" if self.scale == 1.0 else f"{unit} * "
        turned = []
        for axis, sign, bias in zip(self.axis, self.sign, self.bias, strict=True):
            less = f" {'-' if bias > 0.0 else '+'} {literal(abs(float(bias)))}" if bias else ""
            turned.append(f"{'-' if sign < 0.0 else ''}{times}{name}[{axis}]{less}")
        if self.matrix is None:
            return turned
        return [
            " + ".join(f"{literal(float(m))} * ({t})" for m, t in zip(row, turned, strict=True))
            for row in self.matrix
        ]

    def words(self, sensor: str, unit: str) -> str:
        """The channel in words, for the head of a file."""
        along = ", ".join(
            f"{name} {'-' if sign < 0.0 else ''}{'xyz'[axis]}"
            for name, axis, sign in zip(
                ("forward", "right", "down"), self.axis, self.sign, strict=True
            )
        )
        each = f", {self.scale:.10g} {unit} each" if unit and self.scale != 1.0 else ""
        text = f"{sensor}: readings in {self.unit}{each}; axes of the sensor: {along}"
        of = self.unit if self.scale == 1.0 else unit
        if any(self.bias) or sensor == "Gyro":
            bias = ", ".join(f"{v:.6g}" for v in self.bias)
            text += f"; bias subtracted: {bias} {of} forward, right, down"
        if self.matrix is not None:
            rows = "), (".join(", ".join(f"{v:.6g}" for v in row) for row in self.matrix)
            text += f"; then multiplied by ({rows})"
        return f"{text}."


@dataclass(frozen=True)
class SensorConfiguration:
    """How a device reads its sensors: `attitude_sample` takes the raw readings.

    `rate_hz`: of the samples. `gyro`, `accel`, `mag`: their readings; the last two for a filter.
    `sources`: where each figure is from, for the head of the file.
    """

    rate_hz: float
    gyro: Channel = field(default_factory=lambda: Channel("rad/s"))
    accel: Channel = field(default_factory=lambda: Channel("m/s²"))
    mag: Channel = field(default_factory=lambda: Channel("any unit"))
    sources: tuple[str, ...] = ()

    def words(self, sensors: Sequence[str]) -> list[str]:
        """The configuration in words: what the file takes, and where each figure is from."""
        said = {
            "gyro": self.gyro.words("Gyro", "rad/s"),
            "accel": self.accel.words("Accelerometer", "m/s²"),
            "mag": self.mag.words("Magnetometer", "uT"),
        }
        head = f"Configuration of a raw reading: {self.rate_hz:.10g} samples a second."
        return [head, *(said[name] for name in sensors), *self.sources]

"""Configuration of the extrinsics of two sensors."""

from __future__ import annotations

from typing import Literal

from pydantic import StrictBool

from strapdown.config.logs import LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.config.reading import FileSpec
from strapdown.config.spec import Number, Word


class ExtrinsicsSpec(FileSpec):
    """Logs of two sensors on one rigid body."""

    called = "extrinsics"

    kind: Literal["imu", "magnetometer", "gnss"]
    log: LogTable
    #: Log of the other sensor; the same log, if not given.
    other: LogTable | None = None
    #: Orientation of the axes, as `AxesTable.axes`.
    axes: Word | None = None
    other_axes: Word | None = None
    #: Clock of the other less that of the log, roughly; searched, if not given.
    offset_s: Number | None = None
    #: Whether both have the same clock.
    one_clock: StrictBool = False
    #: Of fixes: the smoothed run whose states are the extrinsics.
    navigation: NavigationSpec | None = None

"""What every coarse alignment is: a method with options that makes an attitude of a record."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.site import Site
from strapdown.sensors.imu_uncertainty import ImuUncertainty


@dataclass(frozen=True)
class CoarseAlignment(ABC):
    """A way to find the attitude from the sensors' outputs; it holds no state of its own."""

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """Find the attitude.

        Parameters
        ----------
        imu : DataFrame
            Imu table of the time of alignment alone.
        site : Site
        sensors : ImuUncertainty
        gnss : DataFrame, optional
            Gnss table, for methods that need one.

        Returns
        -------
        Alignment
            At the last sample.

        Raises
        ------
        DataError
            The record cannot give the attitude: the message says what is in the way.
        """

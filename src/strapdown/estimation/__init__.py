"""Error models of a mechanization, forms of their covariance, and robust updates."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.estimation.covariance import COVARIANCES, Chernodarov, UpdateRule
    from strapdown.estimation.error_filter import ErrorFilter, FilterState
    from strapdown.estimation.error_model import (
        PHYSICAL,
        ErrorModel,
        QuaternionModel,
        RotationVectorModel,
    )
    from strapdown.estimation.robust import Huber, PaperUpdate, RobustUpdate, Tukey
    from strapdown.estimation.sensor_blocks import gyro_misalignment, gyro_scale

__all__ = [
    "COVARIANCES",
    "PHYSICAL",
    "Chernodarov",
    "ErrorFilter",
    "ErrorModel",
    "FilterState",
    "Huber",
    "PaperUpdate",
    "QuaternionModel",
    "RobustUpdate",
    "RotationVectorModel",
    "Tukey",
    "UpdateRule",
    "gyro_misalignment",
    "gyro_scale",
]

load_on_first_use(
    __name__,
    {
        "covariance": "COVARIANCES Chernodarov UpdateRule",
        "error_filter": "ErrorFilter FilterState",
        "error_model": "PHYSICAL ErrorModel QuaternionModel RotationVectorModel",
        "robust": "Huber PaperUpdate RobustUpdate Tukey",
        "sensor_blocks": "gyro_misalignment gyro_scale",
    },
)

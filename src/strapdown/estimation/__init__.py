"""Error states of a mechanization, their covariance in several forms, and robust updates."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.estimation.covariances import COVARIANCES
    from strapdown.estimation.error_filter import ErrorFilter
    from strapdown.estimation.error_model import PHYSICAL, ErrorModel
    from strapdown.estimation.filter_state import FilterState
    from strapdown.estimation.influence_huber import Huber
    from strapdown.estimation.influence_tukey import Tukey
    from strapdown.estimation.paper_update import PaperUpdate
    from strapdown.estimation.quaternion_model import QuaternionModel
    from strapdown.estimation.robust_update import RobustUpdate
    from strapdown.estimation.rotation_vector_model import RotationVectorModel
    from strapdown.estimation.sensor_blocks import gyro_misalignment, gyro_scale
    from strapdown.estimation.update_rule import UpdateRule
    from strapdown.estimation.wd import Chernodarov

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
        "covariances": "COVARIANCES",
        "error_filter": "ErrorFilter",
        "error_model": "ErrorModel PHYSICAL",
        "filter_state": "FilterState",
        "influence_huber": "Huber",
        "influence_tukey": "Tukey",
        "paper_update": "PaperUpdate",
        "quaternion_model": "QuaternionModel",
        "robust_update": "RobustUpdate",
        "rotation_vector_model": "RotationVectorModel",
        "sensor_blocks": "gyro_misalignment gyro_scale",
        "update_rule": "UpdateRule",
        "wd": "Chernodarov",
    },
)

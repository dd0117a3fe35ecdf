"""Error models of a mechanization, forms of their covariance, and robust updates."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.estimation.covariance import COVARIANCES as COVARIANCES
    from strapdown.estimation.covariance import Chernodarov as Chernodarov
    from strapdown.estimation.covariance import UpdateRule as UpdateRule
    from strapdown.estimation.error_filter import ErrorFilter as ErrorFilter
    from strapdown.estimation.error_filter import FilterState as FilterState
    from strapdown.estimation.error_model import PHYSICAL as PHYSICAL
    from strapdown.estimation.error_model import ErrorModel as ErrorModel
    from strapdown.estimation.error_model import QuaternionModel as QuaternionModel
    from strapdown.estimation.error_model import RotationVectorModel as RotationVectorModel
    from strapdown.estimation.robust import Huber as Huber
    from strapdown.estimation.robust import PaperUpdate as PaperUpdate
    from strapdown.estimation.robust import RobustUpdate as RobustUpdate
    from strapdown.estimation.robust import Tukey as Tukey
    from strapdown.estimation.sensor_blocks import gyro_misalignment as gyro_misalignment
    from strapdown.estimation.sensor_blocks import gyro_scale as gyro_scale


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

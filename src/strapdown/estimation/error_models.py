"""The one table of error models."""

from __future__ import annotations

from strapdown.estimation.error_model import ErrorModel
from strapdown.estimation.quaternion_model import QuaternionModel
from strapdown.estimation.rotation_vector_model import RotationVectorModel

ERROR_MODELS: dict[str, type[ErrorModel]] = {
    "rotation_vector": RotationVectorModel,
    "quaternions": QuaternionModel,
}

"""What a log's numbers say of its units, axes and clock: one file a question."""

from strapdown.formats.inference.conclusion import THRESHOLD, Inference
from strapdown.formats.inference.infer import Signals, infer, infer_signals

__all__ = ["THRESHOLD", "Inference", "Signals", "infer", "infer_signals"]

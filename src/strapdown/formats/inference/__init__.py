"""Inference of a log's units, axes and clock from its numbers: one module per question."""

from strapdown.formats.inference.conclusion import THRESHOLD, Inference
from strapdown.formats.inference.infer import Signals, infer, infer_signals

__all__ = ["THRESHOLD", "Inference", "Signals", "infer", "infer_signals"]

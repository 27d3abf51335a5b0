"""All estimators at once: samples with their times in, the documented columns out."""

from papilla.estimators.pipeline.answer import PipelineEstimate
from papilla.estimators.pipeline.clock import path
from papilla.estimators.pipeline.pipeline import Pipeline, PipelineState

__all__ = ["Pipeline", "PipelineEstimate", "PipelineState", "path"]

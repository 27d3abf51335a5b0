"""All estimators at once: takes samples with their times, and returns the documented columns."""

from papilla.estimators.pipeline.clock import path
from papilla.estimators.pipeline.pipeline import Pipeline, PipelineEstimate, PipelineState

__all__ = ["Pipeline", "PipelineEstimate", "PipelineState", "path"]

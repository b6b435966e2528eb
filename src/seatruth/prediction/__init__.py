"""Prediction: the figures of manoeuvres that an estimate predicts, with intervals, beside the measured ones.

from seatruth import predict

found = predict(study, estimate)
found.figures
"""

from seatruth.prediction.intervals import FORM_ERROR
from seatruth.prediction.pipeline import DRAWS, IMO, predict
from seatruth.prediction.results import Predictions

__all__ = ["DRAWS", "FORM_ERROR", "IMO", "Predictions", "predict"]

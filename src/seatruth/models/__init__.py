"""What a simulator believes about a vehicle: the Model interface, the built-in models and how a user's own is found."""

from seatruth.models.base import Model, Surroundings
from seatruth.models.blackbox import BlackBox
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter, Prior
from seatruth.models.registry import available, broken, load_model
from seatruth.trials.channel import Channel

__all__ = [
    "BlackBox",
    "Channel",
    "Dimensions",
    "Model",
    "Parameter",
    "Prior",
    "Surroundings",
    "available",
    "broken",
    "load_model",
]

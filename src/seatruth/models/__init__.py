"""What a simulator believes about a vehicle: the Model interface, the built-in models and how a user's own is found."""

from seatruth.models.base import Environment, Model
from seatruth.models.black_box import BlackBox
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter, Prior
from seatruth.models.registry import available, broken, load_model
from seatruth.trials.channel import Channel

__all__ = [
    "BlackBox",
    "Channel",
    "Dimensions",
    "Environment",
    "Model",
    "Parameter",
    "Prior",
    "available",
    "broken",
    "load_model",
]

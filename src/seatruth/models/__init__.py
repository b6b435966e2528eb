"""The Model interface, the built-in models, and the registry that loads them or a user's own."""

from seatruth.models.actuators import Rudder, Thruster
from seatruth.models.base import Environment, Model
from seatruth.models.black_box import BlackBox
from seatruth.models.fmu import FMU, load_fmu
from seatruth.models.geometry import Dimensions
from seatruth.models.isolated import IsolatedBlackBox
from seatruth.models.measures import MEASURES
from seatruth.models.observed import Observation, observed
from seatruth.models.parameter import Parameter, Prior
from seatruth.models.ports import Ports
from seatruth.models.registry import available, broken, load_model
from seatruth.models.servo_black_box import ServoBlackBox, with_servos
from seatruth.models.with_areas import with_areas
from seatruth.models.with_servos import Order, WithServos
from seatruth.models.wrapper import ModelWrapper
from seatruth.trials.channel import Channel

__all__ = [
    "FMU",
    "MEASURES",
    "BlackBox",
    "Channel",
    "Dimensions",
    "Environment",
    "IsolatedBlackBox",
    "Model",
    "ModelWrapper",
    "Observation",
    "Order",
    "Parameter",
    "Ports",
    "Prior",
    "Rudder",
    "ServoBlackBox",
    "Thruster",
    "WithServos",
    "available",
    "broken",
    "load_fmu",
    "load_model",
    "observed",
    "with_areas",
    "with_servos",
]

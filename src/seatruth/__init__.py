"""seatruth: from a marine vehicle's trials to the parameters of its model, with error bars.

    from seatruth import identify, load_study, write_report

    estimate = identify(load_study("study.toml"))
    write_report(estimate, "report.html")

The names below are loaded when first used, so that `import seatruth` costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from seatruth.comparison import Comparison, compare
    from seatruth.diagnosis import Diagnosis, diagnose
    from seatruth.errors import BadInput, PluginError, SeatruthError, SeatruthWarning
    from seatruth.estimate import Estimate
    from seatruth.identification import Study, identify
    from seatruth.models import BlackBox, Model, Parameter, Prior, load_model
    from seatruth.optimizers import Budget, Optimizer, minimise
    from seatruth.report import write_report
    from seatruth.simulate import simulator
    from seatruth.study import load_study
    from seatruth.trials import Channel, Trial, Trials, check_trials, read_trial

    __version__: str

__all__ = [
    "BadInput",
    "BlackBox",
    "Budget",
    "Channel",
    "Comparison",
    "Diagnosis",
    "Estimate",
    "Model",
    "Optimizer",
    "Parameter",
    "PluginError",
    "Prior",
    "SeatruthError",
    "SeatruthWarning",
    "Study",
    "Trial",
    "Trials",
    "__version__",
    "check_trials",
    "compare",
    "diagnose",
    "identify",
    "load_model",
    "load_study",
    "minimise",
    "read_trial",
    "simulator",
    "write_report",
]

_HOMES = {
    "comparison": ("Comparison", "compare"),
    "errors": ("BadInput", "PluginError", "SeatruthError", "SeatruthWarning"),
    "estimate": ("Estimate",),
    "diagnosis": ("Diagnosis", "diagnose"),
    "identification": ("Study", "identify"),
    "models": ("BlackBox", "Model", "Parameter", "Prior", "load_model"),
    "optimizers": ("Budget", "Optimizer", "minimise"),
    "report": ("write_report",),
    "simulate": ("simulator",),
    "study": ("load_study",),
    "trials": ("Channel", "Trial", "Trials", "check_trials", "read_trial"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """The public name, imported from the module where it lives and kept."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("seatruth")
    elif name in _HOME:
        value = getattr(importlib.import_module(f"seatruth.{_HOME[name]}"), name)
    else:
        raise AttributeError(f"module 'seatruth' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

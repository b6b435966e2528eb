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
    from seatruth.cost_forecast import Forecast, forecast
    from seatruth.costs.options import FormulaOptions, RegressionOptions, TrajectoryOptions
    from seatruth.diagnosis import Diagnosis, diagnose
    from seatruth.errors import BadInput, PluginError, SeatruthError, SeatruthWarning
    from seatruth.estimate import Estimate
    from seatruth.identification import identify
    from seatruth.models import BlackBox, IsolatedBlackBox, Model, Parameter, Prior, load_fmu, load_model
    from seatruth.optimizers import Budget, Optimizer, minimise
    from seatruth.prediction import Predictions, predict
    from seatruth.progress import ProgressEvent
    from seatruth.report import write_report
    from seatruth.simulate import simulator
    from seatruth.study import OutputSettings, Study, load_study
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
    "Forecast",
    "FormulaOptions",
    "IsolatedBlackBox",
    "Model",
    "Optimizer",
    "OutputSettings",
    "Parameter",
    "PluginError",
    "Predictions",
    "Prior",
    "ProgressEvent",
    "RegressionOptions",
    "SeatruthError",
    "SeatruthWarning",
    "Study",
    "TrajectoryOptions",
    "Trial",
    "Trials",
    "__version__",
    "check_trials",
    "compare",
    "diagnose",
    "forecast",
    "identify",
    "load_fmu",
    "load_model",
    "load_study",
    "minimise",
    "predict",
    "read_trial",
    "simulator",
    "write_report",
]

_MODULES = {
    "comparison": ("Comparison", "compare"),
    "cost_forecast": ("Forecast", "forecast"),
    "costs.options": ("FormulaOptions", "RegressionOptions", "TrajectoryOptions"),
    "diagnosis": ("Diagnosis", "diagnose"),
    "errors": ("BadInput", "PluginError", "SeatruthError", "SeatruthWarning"),
    "estimate": ("Estimate",),
    "identification": ("identify",),
    "models": ("BlackBox", "IsolatedBlackBox", "Model", "Parameter", "Prior", "load_fmu", "load_model"),
    "optimizers": ("Budget", "Optimizer", "minimise"),
    "prediction": ("Predictions", "predict"),
    "progress": ("ProgressEvent",),
    "report": ("write_report",),
    "simulate": ("simulator",),
    "study": ("OutputSettings", "Study", "load_study"),
    "trials": ("Channel", "Trial", "Trials", "check_trials", "read_trial"),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    """The public name, imported from the module where it lives and kept."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("seatruth")
    elif name in _MODULE_OF:
        value = getattr(importlib.import_module(f"seatruth.{_MODULE_OF[name]}"), name)
    else:
        raise AttributeError(f"module 'seatruth' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

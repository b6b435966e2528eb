"""What a first study file says of parameters: which are free, how well they are known, and the values of the others."""

from __future__ import annotations

import math
from collections.abc import Sequence

from seatruth.models import FMU, Model, Parameter
from seatruth.study.proposals import is_measured
from seatruth.study.template_simulator import free_parameters

_USUAL = ("Y_v", "Y_r", "N_v", "N_r", "Z_w", "Z_q", "M_w", "M_q", "Zw", "Zq", "Mw", "Mq")
"""Linear hull derivatives: what a first fit usually asks for, where a model frees nothing itself."""
_WHY = (
    "# Free are those with bounds that no scale, drawing or data sheet gives: no mass, inertia or size,",
    "# and no added mass but one whose source says that it is guessed.",
)
_KNOWN = 0.2
"""Standard deviation over the value that a diagnosis takes where a study states none (`diagnosis.settings`)."""


def parameter_lines(model: Model, *, own: bool) -> list[str]:
    """The free parameters and the table [parameters]; `own` says that the model is the user's."""
    declared = [parameter.name for parameter in model.parameters if parameter.vary]
    bounded = [p.name for p in model.parameters if p.expr is None and math.isfinite(p.min) and math.isfinite(p.max)]
    # Of a model of one's own, all that no scale or drawing says: an error in what is held looks like a cause.
    unsure = [p.name for p in model.parameters if p.name in bounded and not is_measured(p)]
    usual = declared or [name for name in bounded if name in _USUAL and not own]
    first = free_parameters(model) if isinstance(model, FMU) else unsure or _forces(model, bounded) or bounded[:4]
    free = usual or first or [p.name for p in model.parameters[:1]]
    listing = ", ".join(f'"{name}"' for name in free)
    lines = [
        "# Parameters to identify, by name or pattern. `seatruth check` says which of them this log can move.",
        *(_WHY if free == unsure and not usual else ()),
        f"vary = [{listing}]",
        "",
        "[parameters]",
        *_priors([p for p in model.parameters if p.name in free]),
        "# The others keep these values. Give yours: NAME = 1.0, or { value = 1.0, vary = true, min = 0.0, max = 2 },",
        '# or with a prior: { vary = true, prior = { mean = 1.0, sd = 0.1 } }, or computed: { expr = "-0.5 * OTHER" }.',
    ]
    lines += [f"# {p.name} = {_number(p.value)}{_about(p)}" for p in model.parameters if p.name not in free]
    return [*lines, ""]


def _forces(model: Model, bounded: Sequence[str]) -> list[str]:
    """What is no mass and no size, where sources that name a data sheet for everything leave nothing to free."""
    return [p.name for p in model.parameters if p.name in bounded and not is_measured(p.replace(source=""))]


def _priors(free: list[Parameter]) -> list[str]:
    """A line for each free parameter, to be corrected and taken over by hand: nothing says how well it is known."""
    open_ones = [p for p in free if p.prior is None and math.isfinite(p.value)]
    if not open_ones:
        return []
    return [
        "# What is known of the free ones before the trials. `seatruth diagnose` takes these lines if nothing is said",
        f"# ({100.0 * _KNOWN:.0f} % of the value as standard deviation; ? for a value of 0). Correct them; drop the #.",
        *(
            f"# {p.name} = {{ prior = {{ mean = {_number(p.value)}, sd = {_spread(p)} }} }}{_about(p)}"
            for p in open_ones
        ),
    ]


def _spread(parameter: Parameter) -> str:
    """Of a value of zero no part of it says how well it is known: a place for what the user knows."""
    return f"{_KNOWN * abs(parameter.value):.6g}" if parameter.value != 0.0 else "?"


def _about(parameter: Parameter) -> str:
    unit = "" if parameter.unit in ("", "1") else f"[{parameter.unit}]"
    about = one_line(" ".join(part for part in (parameter.description, unit) if part))
    return f"   # {about}" if about else ""


def one_line(text: str) -> str:
    """The text as it can stand in a comment.

    Example:
        >>> one_line("of\\n two\\tlines")
        'of two lines'
    """
    return "".join(c if c.isprintable() else " " for c in " ".join(text.split()))


def _number(value: float) -> str:
    text = repr(float(value))
    return text if "inf" not in text and "nan" not in text else "0.0"

"""The page: sections put into one HTML file that loads nothing from anywhere."""

from __future__ import annotations

import base64
import functools
import hashlib
import importlib.metadata
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup

from seatruth.diagnosis.results import Diagnosis
from seatruth.report.blocks import Section
from seatruth.report.diagnosis import diagnosis_facts, diagnosis_sections
from seatruth.report.numbers import moment
from seatruth.report.sections import sections
from seatruth.report.view import View, view
from seatruth.storage.atomic import write_file

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

_SYNTHETIC = "These trials were made by a simulator. Nothing here was measured at sea."
_UNITS = (
    "Angles are shown in degrees; everything else in SI units. Positions: x up (north, or the basin's axis), y to the "
    "right; heading clockwise."
)


def write_report(result: Estimate | Diagnosis, path: str | Path) -> None:
    """Writes the report of an estimate or a diagnosis as one HTML file.

    The file needs nothing else. It is written whole or not at all; the same result gives the same bytes.

    Args:
        result: what `identify` or `diagnose` returned, or what was loaded again.
        path: the HTML file; its folder is made where it does not exist.

    Raises:
        OSError: the file cannot be written.

    Example:
        >>> import seatruth.sample
        >>> from pathlib import Path
        >>> from seatruth import Budget, identify, write_report
        >>> estimate = identify(seatruth.sample.load(), budget=Budget(evaluations=40))
        >>> write_report(estimate, "report.html")
        >>> Path("report.html").read_text().startswith("<!DOCTYPE html>")
        True
    """
    write_file(path, render(result))


def render(result: Estimate | Diagnosis) -> str:
    """The report as HTML text."""
    synthetic = _SYNTHETIC if getattr(result, "synthetic", False) else ""
    if isinstance(result, Diagnosis):
        facts, found = diagnosis_facts(result), diagnosis_sections(result)
        return page("Diagnosis", result.study, facts, found, synthetic=synthetic, units=_UNITS)
    data = view(result)
    title = _name(getattr(result, "study", None)) or "Study"
    return page("Identification", title, _facts(data), sections(data), synthetic=synthetic, units=_UNITS)


def page(
    kind: str,
    title: str,
    facts: Sequence[tuple[str, str]],
    found: Sequence[Section],
    *,
    synthetic: str = "",
    units: str = "",
) -> str:
    """A report of any kind as HTML text. `synthetic` is what its banner says, "" for none; `units` ends the page."""
    script = _source("report.js")
    return _template().render(
        kind=kind,
        title=title,
        synthetic=bool(synthetic),
        synthetic_note=synthetic,
        units_note=units,
        facts=facts,
        sections=found,
        ids={section.id: section.title for section in found},
        css=Markup(_source("style.css")),
        script=Markup(script),
        script_hash=Markup(base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()),
        version=importlib.metadata.version("seatruth"),
    )


@functools.cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("seatruth.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )


def _template() -> Template:
    return _environment().get_template("report.html")


def _source(name: str) -> str:
    environment = _environment()
    assert environment.loader is not None
    return environment.loader.get_source(environment, name)[0].strip()


def _name(thing: Any) -> str:
    """The name of a study or model, whether it is a text, a table or an object."""
    if isinstance(thing, dict):
        return str(thing.get("title") or thing.get("name") or "")
    return str(getattr(thing, "name", thing) or "")


def _facts(data: View) -> list[tuple[str, str]]:
    """What stands under the title."""
    estimate = data.estimate
    optimizer = getattr(estimate, "optimizer", None) or {}
    fitted = data.fitted["trial"].nunique()
    held = data.held_out["trial"].nunique()
    trials = f"{fitted} fitted" + (f", {held} held out" if held else "")
    cost = getattr(estimate, "cost", None) or {}
    provenance = getattr(estimate, "provenance", None) or {}
    facts = [
        ("Model", _name(getattr(estimate, "model", None))),
        ("Trials", trials if fitted or held else ""),
        ("Free parameters", str(len(data.parameters)) if len(data.parameters) else ""),
        ("Cost", str(cost.get("kind", cost.get("name", "")))),
        ("Optimizer", _optimizer(optimizer)),
        ("Time", moment(provenance)),
    ]
    return [(name, value) for name, value in facts if value]


def _optimizer(said: dict[str, Any]) -> str:
    """Its name; of a hybrid, those of its stages."""
    stages = [str(stage.get("name", "")) for stage in said.get("stages") or [] if isinstance(stage, dict)]
    return ", then ".join(stages) or str(said.get("name", ""))

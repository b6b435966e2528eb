"""The page: sections put into one HTML file that loads nothing from anywhere."""

from __future__ import annotations

import functools
import importlib.metadata
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup

from seatruth.report.sections import sections
from seatruth.report.view import View, view

if TYPE_CHECKING:
    from seatruth.estimate import Estimate


def write_report(estimate: Estimate, path: str | Path) -> None:
    """Writes the report of an estimate as one HTML file; the same estimate gives the same bytes.

    The file is written whole or not at all. Raises OSError where it cannot be written.
    """
    target = Path(path)
    text = render(estimate)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def render(estimate: Estimate) -> str:
    """The report as HTML text."""
    data = view(estimate)
    found = sections(data)
    return _template().render(
        title=_name(getattr(estimate, "study", None)) or "Study",
        synthetic=bool(getattr(estimate, "synthetic", False)),
        facts=_facts(data),
        sections=found,
        ids={section.id: section.title for section in found},
        css=Markup(_css()),
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


def _css() -> str:
    environment = _environment()
    assert environment.loader is not None
    return environment.loader.get_source(environment, "style.css")[0].strip()


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
        ("Time", _time(str(provenance.get("time_utc", "")))),
    ]
    return [(name, value) for name, value in facts if value]


def _time(text: str) -> str:
    """ "2026-01-02T03:04:05Z" as "2026-01-02 03:04 UTC"."""
    return f"{text[:10]} {text[11:16]} UTC" if text.endswith("Z") and len(text) == 20 else text


def _optimizer(said: dict[str, Any]) -> str:
    """Its name; of a hybrid, those of its stages."""
    stages = [str(stage.get("name", "")) for stage in said.get("stages") or [] if isinstance(stage, dict)]
    return ", then ".join(stages) or str(said.get("name", ""))

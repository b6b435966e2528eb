"""What a study says of single inputs between their samples."""

from __future__ import annotations

from seatruth.models import BlackBox
from seatruth.models.base import Model
from seatruth.models.with_holds import WithHolds
from seatruth.study.schema import StudyFile
from seatruth.study.validation import Problems


def with_holds(model: Model, file: StudyFile, problems: Problems) -> Model:
    """The model with the rules of its inputs; notes those of what is no input, and of what knows no such rule."""
    inputs = {channel.name for channel in model.inputs}
    holds = {name: table.hold for name, table in file.channels.items() if table.hold is not None}
    for number, entry in enumerate(file.trials):
        for name in (name for name, table in entry.channels.items() if table.hold is not None):
            do = f"Put it into {name!r} of [channels]."
            problems.add(("trials", number, "channels", name, "hold"), "it is the same in all trials", do)
    for name in [name for name in holds if name not in inputs]:
        what = f"{name!r} is no input of the model, and only inputs are joined between samples"
        problems.add(("channels", name, "hold"), what, "Remove it.")
        del holds[name]
    if holds and isinstance(model, BlackBox):
        what = "a simulator that integrates by itself joins or holds all its inputs alike"
        do = "Remove it; set `hold` in [cost], or move the input by half a sample (step `shift_time`)."
        problems.add(("channels", next(iter(holds)), "hold"), what, do)
        return model
    return WithHolds(model, holds) if holds else model

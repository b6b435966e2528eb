"""What a study says of single inputs between their samples."""

from __future__ import annotations

from seatruth.models.base import Model
from seatruth.models.with_holds import WithHolds
from seatruth.study.schema import StudyFile
from seatruth.study.validation import Problems


def with_holds(model: Model, file: StudyFile, problems: Problems) -> Model:
    """The model with the rules of its inputs; notes those of what is no input, and of what knows no such rule."""
    for name, table in file.channels.items():
        if table.hold is not None:
            with problems.at("channels", name, "hold"):
                model = WithHolds(model, {name: table.hold})
    for number, entry in enumerate(file.trials):
        for name, changes in entry.channels.items():
            if changes.hold is not None:
                do = f"Put it into {name!r} of [channels]."
                problems.add(("trials", number, "channels", name, "hold"), "it is the same in all trials", do)
    return model

"""The embedded sample: synthetic trials of a ship model, and a study of them. See README.md beside the files."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from seatruth.study import Study

FOLDER = Path(__file__).parent
STUDY = "study.toml"


def load(name: str = STUDY) -> Study:
    """Loads a study of the sample: "study.toml" (identification) or "diagnose.toml" (diagnosis).

    Example:
        >>> import seatruth.sample
        >>> seatruth.sample.load().model.name
        'mmg'
    """
    from seatruth.study import load_study  # a study needs half a second to import; copying files does not

    return load_study(FOLDER / name)


def copy_to(folder: str | Path) -> Path:
    """Copies the sample's study and trials into `folder` (made if need be) and returns the study file's path."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    for file in sorted(FOLDER.iterdir()):
        if file.suffix in (".csv", ".toml", ".md"):
            shutil.copyfile(file, target / file.name)
    return target / STUDY

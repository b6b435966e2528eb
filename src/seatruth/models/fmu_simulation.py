"""One run of an FMU through a trial: inputs in, communication steps, outputs out, all in the FMU's own units."""

from __future__ import annotations

import atexit
import math
import shutil
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, PluginError
from seatruth.models.ports import Outside
from seatruth.trials.trial import Trial

_SETTERS = {2: {"Enumeration": "Integer"}, 3: {"Real": "Float64"}}
"""Types that the functions of the FMI call otherwise, by version."""


class Link(NamedTuple):
    """A quantity of seatruth and the FMU's variable that stands for it: FMU's number = (number - offset) / factor."""

    name: str
    reference: int
    kind: str
    factor: float = 1.0
    offset: float = 0.0

    def inside(self, value: float) -> float:
        """The FMU's number in seatruth's unit."""
        return value * self.factor + self.offset

    def outside(self, value: float) -> float:
        """A number of seatruth in the FMU's unit."""
        return (value - self.offset) / self.factor


@dataclass(frozen=True)
class Plan:
    """How an FMU is simulated: which of its variables are what, and its steps.

    `step` s is the longest communication step, 0 for one a sample; with `fixed_step` every step is as long.
    """

    folder: str
    version: int
    identifier: str
    token: str
    inputs: tuple[Link, ...]
    outputs: tuple[Link, ...]
    parameters: tuple[Link, ...]
    initial: tuple[Link, ...]
    ports: tuple[Link, ...]
    angles: tuple[str, ...]
    step: float
    fixed_step: bool
    hold: Literal["foh", "zoh"]


class FMURun:
    """The function of an FMU's black box: runs it once, from its instantiation to its end.

    Inputs are straight lines between samples (or held, with hold = "zoh"); the FMU gets the value in the middle of each
    communication step, whose error falls with the square of the step. So does that of what acts through ports, which
    is carried on from the last two steps to the middle of the next.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    def __call__(
        self,
        trial: Trial,
        parameters: Mapping[str, float],
        first_state: Mapping[str, float] | None,
        outside: Outside | None = None,
    ) -> dict[str, Array]:
        plan = self.plan
        t = np.asarray(trial.t, dtype=np.float64) - float(trial.t[0])
        grid = _grid(t, plan.step, plan.fixed_step)
        fmu = _Instance(plan)
        try:
            fmu.set(plan.parameters, [parameters[link.name] for link in plan.parameters])
            if first_state is not None:
                fmu.set(plan.initial, [first_state[link.name] for link in plan.initial])
            fmu.start(float(grid[-1]))
            found = self._steps(fmu, t, grid, trial, outside)
        finally:
            fmu.end()
        return {link.name: found[:, k] for k, link in enumerate(plan.outputs)}

    def _steps(self, fmu: _Instance, t: Array, grid: Array, trial: Trial, outside: Outside | None) -> Array:
        """Outputs (n, D) at the samples; NaN from where the FMU reports an error."""
        plan = self.plan
        inputs = self._inputs(t, grid, trial)
        rows = np.full((len(grid), len(plan.outputs)), math.nan)
        names = [link.name for link in plan.outputs]
        before: list[float] | None = None
        last = 0.0
        fmu.set(
            plan.inputs, inputs[0].tolist() if len(inputs) else [float(trial.inputs[c.name][0]) for c in plan.inputs]
        )
        try:
            fmu.initialised()
            rows[0] = fmu.get(plan.outputs)
            for k, (time, h) in enumerate(zip(grid[:-1].tolist(), np.diff(grid).tolist())):
                fmu.set(plan.inputs, inputs[k].tolist())
                if plan.ports and outside is not None:
                    acting = outside(time + float(trial.t[0]), dict(zip(names, rows[k].tolist())))
                    now = [acting[link.name] for link in plan.ports]
                    ahead = 0.0 if before is None else 0.5 * h / last
                    fmu.set(plan.ports, [x + ahead * (x - y) for x, y in zip(now, before or now)])
                    before, last = now, h
                fmu.step(time, h)
                rows[k + 1] = fmu.get(plan.outputs)
        except _Refused:
            pass
        return _at_samples(t, grid, rows, [name in plan.angles for name in names])

    def _inputs(self, t: Array, grid: Array, trial: Trial) -> Array:
        """Inputs (steps, I) of each communication step."""
        middle = 0.5 * (grid[:-1] + grid[1:])
        columns = []
        for link in self.plan.inputs:
            values = np.asarray(trial.inputs[link.name], dtype=np.float64)
            if self.plan.hold == "zoh":
                columns.append(values[np.searchsorted(t, grid[:-1] + 1e-9 * (1.0 + grid[:-1]), side="right") - 1])
            else:
                columns.append(np.interp(middle, t, values))
        return np.stack(columns, axis=1) if columns else np.zeros((len(middle), 0))


def _grid(t: Array, step: float, fixed: bool) -> Array:
    """Communication points, s, from zero on: all samples where steps may vary, else multiples of the step."""
    if len(t) < 2:
        return np.array(t)
    if fixed:
        length = step or float(np.median(np.diff(t)))
        count = math.ceil(float(t[-1]) / length - 1e-6)
        return np.asarray(length * np.arange(count + 1))
    parts = np.ones(len(t) - 1, dtype=np.int64)
    if step > 0.0:
        parts = np.maximum(1, np.ceil(np.diff(t) / step - 1e-6)).astype(np.int64)
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(t[:-1], t[1:], parts)]
    return np.concatenate([*pieces, t[-1:]])


def _at_samples(t: Array, grid: Array, rows: Array, angles: Sequence[bool]) -> Array:
    """Outputs at the samples, linear between communication points; angles run on through a full turn."""
    found = np.empty((len(t), rows.shape[1]))
    for column, angle in enumerate(angles):
        values = rows[:, column]
        if angle and np.isfinite(values).all():
            values = np.unwrap(values)
        found[:, column] = np.interp(t, grid, values)
    return found


class _Refused(Exception):
    """A step that the FMU would not do."""


class _Instance:
    """One instance of an FMU of version 2 or 3, behind the same few functions."""

    def __init__(self, plan: Plan) -> None:
        import fmpy.fmi2
        import fmpy.fmi3
        from fmpy.fmi1 import FMICallException

        self._version, self._problem = plan.version, FMICallException
        kind = fmpy.fmi2.FMU2Slave if plan.version == 2 else fmpy.fmi3.FMU3Slave
        self._fmu: Any = kind(guid=plan.token, modelIdentifier=plan.identifier, unzipDirectory=plan.folder)
        try:
            self._fmu.instantiate()
        except Exception as problem:  # fmpy raises a plain Exception
            raise PluginError(f"the FMU could not be instantiated ({problem})") from None

    def start(self, stop: float) -> None:
        if self._version == 2:
            self._fmu.setupExperiment(startTime=0.0, stopTime=stop)
            self._fmu.enterInitializationMode()
        else:
            self._fmu.enterInitializationMode(startTime=0.0, stopTime=stop)

    def initialised(self) -> None:
        self._fmu.exitInitializationMode()

    def set(self, links: Sequence[Link], values: Sequence[float]) -> None:
        for kind, group in groupby(zip(links, values), key=lambda pair: pair[0].kind):
            pairs = list(group)
            numbers: list[Any] = [link.outside(value) for link, value in pairs]
            if kind == "Boolean":
                numbers = [value != 0.0 for value in numbers]
            elif kind not in ("Real", "Float64", "Float32"):
                numbers = [round(value) for value in numbers]
            self._function("set", kind)([link.reference for link, _ in pairs], numbers)

    def get(self, links: Sequence[Link]) -> list[float]:
        found: list[float] = []
        for kind, group in groupby(links, key=lambda link: link.kind):
            some = list(group)
            values = self._function("get", kind)([link.reference for link in some])
            found += [link.inside(float(value)) for link, value in zip(some, values)]
        return found

    def step(self, time: float, h: float) -> None:
        try:
            ended = self._fmu.doStep(currentCommunicationPoint=time, communicationStepSize=h)
        except self._problem:
            raise _Refused from None
        if ended is not None and (ended[1] or ended[2]):  # FMI 3: it wants to end, or returned early
            raise _Refused

    def end(self) -> None:
        """Frees the instance; the library stays, as some cannot be loaded twice."""
        self._fmu.freeInstance()

    def _function(self, verb: str, kind: str) -> Any:
        return getattr(self._fmu, verb + _SETTERS[self._version].get(kind, kind))


_FOLDERS: dict[str, tempfile.TemporaryDirectory[str]] = {}


def unpacked(path: Path, checksum: str) -> str:
    """The folder in which an FMU lies unpacked until this process ends; one for each FMU.

    Raises:
        BadInput: the archive is damaged or holds a path that leads elsewhere.
    """
    if checksum not in _FOLDERS:
        import fmpy

        with zipfile.ZipFile(path) as archive:
            size = sum(file.file_size for file in archive.infolist())
        left = shutil.disk_usage(tempfile.gettempdir()).free
        if size > left:
            what = f"it unpacks to {size / 1e9:.3g} GB, and {tempfile.gettempdir()} has {left / 1e9:.3g} GB left"
            raise BadInput(what, where=path.name, do="Free some space, or set TMPDIR to a folder with more.")
        folder = tempfile.TemporaryDirectory(prefix="seatruth-fmu-")
        try:
            fmpy.extract(str(path), unzipdir=folder.name)
        except Exception as problem:  # zipfile and fmpy raise many kinds
            folder.cleanup()
            raise BadInput(f"it cannot be unpacked ({problem})", where=path.name, do="Export it again.") from None
        _FOLDERS[checksum] = folder
    return _FOLDERS[checksum].name


@atexit.register
def _remove() -> None:
    for folder in _FOLDERS.values():
        folder.cleanup()

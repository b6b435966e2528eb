"""One recorded run, and a set of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, overload

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest


@dataclass(frozen=True)
class Step:
    """One thing that was done to a trial's data: shown in every result, so that nothing changes silently."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    effect: str = ""
    """What it did, in words and numbers ("removed 14 of 6000 samples of u")."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One recorded run in SI units. Its arrays are read-only; a preparation step returns a new Trial.

    Args:
        name: name of the run.
        t: time (n,) s, strictly increasing.
        inputs: channel name -> (n,), finite everywhere.
        outputs: channel name -> (n,); a sample that is NaN is not valid and takes no part in any fit.
        conditions: what held during the run (loading, depth, sea state).
        steps: what was done to the data.
        source: the file it came from.
        synthetic: True if a simulator made it.
        lines: line (n,) of the source file of each sample, 0 where there is none.
        absent: outputs that the run is known not to have recorded.

    Raises:
        BadInput: shapes differ, or time does not increase.

    Example:
        >>> from seatruth import Trial
        >>> run = Trial("run", [0.0, 0.5, 1.0], {"delta": [0.0, 0.1, 0.1]}, {"r": [0.0, 0.01, 0.02]})
        >>> run.duration, len(run)
        (1.0, 3)
    """

    name: str
    t: Array
    inputs: Mapping[str, Array]
    outputs: Mapping[str, Array]
    conditions: Mapping[str, Any] = field(default_factory=dict)
    steps: tuple[Step, ...] = ()
    source: str = ""
    synthetic: bool = False
    lines: NDArray[np.int64] | None = None
    absent: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", _frozen(self.t))
        for kind in ("inputs", "outputs"):
            channels = {k: _frozen(v) for k, v in getattr(self, kind).items()}
            for k, v in channels.items():
                if v.shape != self.t.shape:
                    raise BadInput(
                        f"channel {k!r} has shape {v.shape}, time has {self.t.shape}", where=f"trial {self.name!r}"
                    )
            object.__setattr__(self, kind, channels)

    def __len__(self) -> int:
        return int(self.t.size)

    @property
    def duration(self) -> float:
        return float(self.t[-1] - self.t[0]) if len(self) else 0.0

    def channel(self, name: str) -> Array:
        """The samples of one input or output, by name."""
        for kind in (self.outputs, self.inputs):
            if name in kind:
                return kind[name]
        known = [*self.outputs, *self.inputs]
        raise BadInput(f"no channel {name!r}", where=f"trial {self.name!r}", do=nearest(name, known))

    def section(self, start: int, stop: int, name: str | None = None) -> Trial:
        """The samples start..stop-1 as a trial of their own (time is not shifted)."""
        cut = slice(start, stop)
        return replace(
            self,
            name=self.name if name is None else name,
            t=self.t[cut],
            inputs={k: v[cut] for k, v in self.inputs.items()},
            outputs={k: v[cut] for k, v in self.outputs.items()},
            lines=None if self.lines is None else self.lines[cut],
        )

    def samples(self, chosen: NDArray[np.intp], name: str | None = None) -> Trial:
        """The chosen samples, whose places rise, as a trial of their own."""
        return replace(
            self,
            name=self.name if name is None else name,
            t=self.t[chosen],
            inputs={k: v[chosen] for k, v in self.inputs.items()},
            outputs={k: v[chosen] for k, v in self.outputs.items()},
            lines=None if self.lines is None else self.lines[chosen],
        )

    def with_step(self, step: Step, **changes: Any) -> Trial:
        """A copy with changed fields and the step that changed them on record."""
        return replace(self, steps=(*self.steps, step), **changes)

    def table(self) -> pd.DataFrame:
        """All channels as columns, indexed by time."""
        return pd.DataFrame({**self.inputs, **self.outputs}, index=pd.Index(self.t, name="t"))

    def _repr_html_(self) -> str:
        head = f"<p><b>{self.name}</b>: {len(self)} samples, {self.duration:.1f} s"
        label = " (synthetic)" if self.synthetic else ""
        summary = self.table().describe().T[["count", "mean", "std", "min", "max"]]
        table = summary.to_html(float_format=lambda x: f"{x:.4g}")
        return f"{head}{label}</p>{table}"


class Trials(Sequence[Trial]):
    """Several trials of one vehicle, with distinct names.

    Args:
        trials: the trials, in their order.

    Raises:
        BadInput: two trials have the same name.

    Example:
        >>> from seatruth import Trial, Trials
        >>> runs = Trials([Trial("a", [0.0, 1.0], {}, {}), Trial("b", [0.0, 2.0], {}, {})])
        >>> runs["b"].duration, runs[:1].names
        (2.0, ('a',))
    """

    def __init__(self, trials: Sequence[Trial]) -> None:
        names = [trial.name for trial in trials]
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise BadInput(f"two trials are called {twice[0]!r}", do="Give each trial its own name.")
        self._trials = tuple(trials)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(trial.name for trial in self._trials)

    @overload
    def __getitem__(self, key: int | str) -> Trial: ...
    @overload
    def __getitem__(self, key: slice) -> Trials: ...
    def __getitem__(self, key: int | str | slice) -> Trial | Trials:
        if isinstance(key, slice):
            return Trials(self._trials[key])
        if isinstance(key, str):
            if key not in self.names:
                raise BadInput(f"no trial {key!r}", do=nearest(key, self.names))
            return self._trials[self.names.index(key)]
        return self._trials[key]

    def __len__(self) -> int:
        return len(self._trials)

    def __iter__(self) -> Iterator[Trial]:
        return iter(self._trials)

    def only(self, names: Sequence[str]) -> Trials:
        """The named trials, in that order."""
        return Trials([self[name] for name in names])

    def without(self, names: Sequence[str]) -> Trials:
        """All but the named trials."""
        for name in names:
            self[name]
        return Trials([trial for trial in self if trial.name not in names])

    def table(self) -> pd.DataFrame:
        """One row a trial: samples, duration, source, steps."""
        rows = [
            {
                "trial": trial.name,
                "samples": len(trial),
                "duration_s": trial.duration,
                "synthetic": trial.synthetic,
                "source": trial.source,
                "steps": "; ".join(step.name for step in trial.steps),
            }
            for trial in self
        ]
        return pd.DataFrame(rows).set_index("trial") if rows else pd.DataFrame()

    def _repr_html_(self) -> str:
        return str(self.table().to_html())


def _frozen(values: Any) -> Array:
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        own = values.flags.owndata and not values.flags.writeable
        if own:
            return values  # nobody can change it, so a long log needs no second copy
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array

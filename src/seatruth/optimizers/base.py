"""What an optimizer is: a small frozen dataclass of options with one method, `run`.

A solver proposes candidates to a `Problem`; the driver evaluates, counts, keeps the best and stops it. A new solver is
one file:

    @dataclass(frozen=True)
    class RandomSearch(Optimizer):
        name = "random_search"
        title = "Uniform random search"
        needs = frozenset({"values"})
        batch: int = option(50, "candidates a call", low=1)

        def run(self, problem, rng):
            while True:
                problem.values(problem.sample(rng, self.batch))

and one line in the group `seatruth.optimizers` of its package's entry points.
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from seatruth.costs.base import Ability
from seatruth.errors import BadInput, nearest

if TYPE_CHECKING:
    from seatruth.optimizers.problem import Problem


def option(
    default: Any,
    doc: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: Collection[str] | None = None,
) -> Any:
    """A dataclass field that is an option of an optimizer: its default, what it does, and what it may be."""
    return dataclasses.field(default=default, metadata={"doc": doc, "low": low, "high": high, "choices": choices})


@dataclass(frozen=True)
class Optimizer(ABC):
    """A solver. Subclasses are frozen dataclasses whose fields are its options.

    `needs` says what it uses of a cost ("values", "residuals", "derivatives", "regression"); the driver refuses a cost
    that does not give it. An instance holds options only, no state: one instance may serve many runs at once.

    Raises:
        BadInput: an option is not of its type or out of its range.

    Example:
        >>> from dataclasses import dataclass
        >>> from seatruth import Budget, Optimizer, identify
        >>> from seatruth.optimizers import option
        >>> import seatruth.sample
        >>> @dataclass(frozen=True)
        ... class RandomSearch(Optimizer):
        ...     name = "random_search"
        ...     batch: int = option(10, "candidates at once", low=1)
        ...
        ...     def run(self, problem, rng):
        ...         while True:
        ...             problem.values(problem.sample(rng, self.batch))
        >>> estimate = identify(seatruth.sample.load(), RandomSearch(batch=5), budget=Budget(evaluations=20))
        >>> estimate.outcome["evaluations"]
        20
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    def __post_init__(self) -> None:
        kinds = typing.get_type_hints(type(self))
        for field in dataclasses.fields(self):
            value = _checked(self.name, field, kinds[field.name], getattr(self, field.name))
            object.__setattr__(self, field.name, value)

    @abstractmethod
    def run(self, problem: Problem, rng: np.random.Generator) -> str | None:
        """Solves. All randomness comes from `rng`; all evaluations go through `problem`.

        Returns why it stopped by its own rule, in words (the result code is then "converged"). The driver ends it
        otherwise by raising `Stop` out of the problem's methods; it must let that through (`Stop` is not an
        `Exception`, so an ordinary `except Exception` does).
        """

    def describe(self) -> dict[str, Any]:
        """Name and options: what a result and a checkpoint record of it."""
        options = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return {"name": self.name, "options": options}


@dataclass(frozen=True)
class FromCallable(Optimizer):
    """An optimizer made of a plain function `f(problem, rng) -> reason`."""

    name: ClassVar[str] = "callable"
    function: Callable[[Problem, np.random.Generator], str | None]
    abilities: frozenset[Ability]
    label: str

    def __post_init__(self) -> None:
        # The class attributes are defaults: an instance carries its own, as the function is what defines it.
        object.__setattr__(self, "name", self.label)
        object.__setattr__(self, "needs", self.abilities)

    def run(self, problem: Problem, rng: np.random.Generator) -> str | None:
        return self.function(problem, rng)

    def describe(self) -> dict[str, Any]:
        code = getattr(self.function, "__qualname__", type(self.function).__qualname__)
        return {"name": self.label, "options": {"function": f"{getattr(self.function, '__module__', '?')}:{code}"}}


def from_callable(
    function: Callable[[Problem, np.random.Generator], str | None],
    *,
    needs: Collection[Ability] = frozenset({"values"}),
    name: str | None = None,
) -> Optimizer:
    """An optimizer from a function f(problem, rng) that returns why it stopped (or None)."""
    known = frozenset(typing.get_args(Ability))
    for need in needs:
        if need not in known:
            raise BadInput(f"there is no ability {need!r} that a cost could give", do=nearest(need, known))
    label = name or str(getattr(function, "__name__", type(function).__name__))
    return FromCallable(function, frozenset(needs), label)


def with_options(kind: type[Optimizer], options: Mapping[str, Any]) -> Optimizer:
    """An instance of `kind` with these options; a wrong name is refused with the nearest one that exists."""
    known = [field.name for field in dataclasses.fields(kind)]
    for given in options:
        if given not in known:
            none = "" if known else "It takes none."
            raise BadInput(
                f"it has no option {given!r}", where=f"optimizer {kind.name!r}", do=nearest(given, known) or none
            )
    return kind(**options)


def _checked(owner: str, field: dataclasses.Field[Any], kind: Any, value: Any) -> Any:
    """The option's value in its own type, or BadInput."""
    where = f"optimizer {owner!r}, option {field.name!r}"
    allowed = typing.get_args(kind) if typing.get_origin(kind) in (typing.Union, types.UnionType) else (kind,)
    if value is None and type(None) in allowed:
        return None
    if isinstance(value, np.generic):
        value = value.item()
    if float in allowed and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    simple = tuple(k for k in allowed if k in (int, float, str, bool))
    if simple and (not isinstance(value, simple) or (isinstance(value, bool) and bool not in simple)):
        raise BadInput(f"{value!r} is not {_words(simple)}", where=where, do=_range_of(field))
    low, high, choices = (field.metadata.get(key) for key in ("low", "high", "choices"))
    if choices is not None and value not in choices:
        raise BadInput(f"{value!r} is not one of its values", where=where, do=nearest(str(value), choices))
    if isinstance(value, int | float) and not isinstance(value, bool):
        wrong = not math.isfinite(value) or (low is not None and value < low) or (high is not None and value > high)
        if wrong:
            raise BadInput(f"{value!r} is out of range", where=where, do=_range_of(field))
    return value


def _words(kinds: tuple[type, ...]) -> str:
    names = {int: "a whole number", float: "a number", str: "a text", bool: "true or false"}
    return " or ".join(names[kind] for kind in kinds)


def _range_of(field: dataclasses.Field[Any]) -> str:
    low, high = field.metadata.get("low"), field.metadata.get("high")
    if low is not None and high is not None:
        return f"Give {low:g} to {high:g}."
    if low is not None:
        return f"Give {low:g} or more."
    return f"Give {high:g} or less." if high is not None else ""

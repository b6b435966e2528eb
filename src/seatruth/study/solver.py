"""The optimizer and the budget that a study file asks for."""

from __future__ import annotations

from seatruth.errors import nearest
from seatruth.optimizers import Budget, Chain, Optimizer, describe, make, names
from seatruth.study.schema import BudgetTable, OptimizerTable
from seatruth.study.validation import Problems


def optimizer(tables: list[OptimizerTable], problems: Problems) -> Optimizer | None:
    """One optimizer, or a hybrid of several; None where something is wrong with them."""
    if not tables:
        problems.add(("optimizer",), "the list of optimizers is empty", "Remove it, or name one.")
        return None
    stages = [stage for k, table in enumerate(tables) if (stage := _stage(table, k, problems)) is not None]
    if len(stages) != len(tables):
        return None
    shares = [table.share for table in tables]
    if len(stages) == 1:
        if shares[0] is not None:
            problems.add(("optimizer", 0, "share"), "a single optimizer has the whole budget", "Remove `share`.")
        return stages[0]
    stated = tuple(share for share in shares[:-1] if share is not None)
    if shares[-1] is not None or (stated and len(stated) != len(stages) - 1):
        problems.add(("optimizer",), "`share` belongs to every stage but the last, or to none", "Complete them.")
        return None
    with problems.at("optimizer"):
        return Chain(tuple(stages), stated)
    return None


def starts(tables: list[OptimizerTable], problems: Problems) -> int:
    """From how many starts the search is made."""
    for k, table in enumerate(tables[1:], 1):
        if table.starts is not None:
            problems.add(
                ("optimizer", k, "starts"), "a hybrid is started as a whole", "State `starts` in its first table."
            )
    return (tables[0].starts if tables else None) or 1


def budget(table: BudgetTable, problems: Problems) -> Budget:
    """The budget; the usual number of evaluations where the file sets no limit at all."""
    stated = table.model_dump(exclude_none=True, exclude={"diagnosis"})
    if not {"evaluations", "seconds", "stall"} & set(stated):
        return Budget(**stated)
    with problems.at("budget"):
        return Budget(**{"evaluations": None, **stated})
    return Budget()


def _stage(table: OptimizerTable, position: int, problems: Problems) -> Optimizer | None:
    known = names()
    if table.use not in known:
        problems.add(
            ("optimizer", position, "use"), f"no optimizer {table.use!r} is installed", nearest(table.use, known)
        )
        return None
    options = [option.name for option in describe(table.use).options]
    wrong = [key for key in table.options if key not in options]
    for key in wrong:
        hint = nearest(key, options) or "It takes none."
        problems.add(("optimizer", position, key), f"optimizer {table.use!r} has no option {key!r}", hint)
    if wrong:
        return None
    with problems.at("optimizer", position):
        return make(table.use, **table.options)
    return None

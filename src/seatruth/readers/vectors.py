"""Named vectors of a MATLAB or HDF5 file as topics: one table where all are of one length, else one a struct."""

from __future__ import annotations

from collections.abc import Mapping

from seatruth.errors import BadInput, nearest
from seatruth.readers.base import Column, Topic
from seatruth.readers.headers import named


def topics(found: Mapping[str, Column], source: str, variable: str | None = None) -> list[Topic]:
    """The topics of vectors that are called "struct.field"; BadInput where their lengths make no tables."""
    if variable is not None:
        chosen = {name: values for name, values in found.items() if _belongs(name, variable)}
        if not chosen:
            known = {name.partition(".")[0].partition("(")[0] for name in found}
            raise BadInput(
                f"no variable {variable!r} with columns of numbers", where=source, do=nearest(variable, known)
            )
        found = chosen
    if not found:
        raise BadInput("it holds no columns of numbers", where=source, do="Store vectors of one length.")
    longer = {name: values for name, values in found.items() if len(values) > 1}
    if not longer:
        raise BadInput("its variables are single numbers", where=source, do="Store vectors of one length.")
    if len({len(values) for values in longer.values()}) == 1:
        return [_topic("", _short_names(list(longer)), longer, source)]
    structs: dict[str, dict[str, Column]] = {}
    for name, values in longer.items():
        structs.setdefault(name.rpartition(".")[0], {})[name] = values
    return [
        _topic(struct, [n.rpartition(".")[2] for n in fields], fields, source) for struct, fields in structs.items()
    ]


def _topic(name: str, headers: list[str], fields: Mapping[str, Column], source: str) -> Topic:
    lengths = {field: len(values) for field, values in fields.items()}
    usual = max(set(lengths.values()), key=lambda length: (list(lengths.values()).count(length), length))
    for field, length in lengths.items():
        if length != usual:
            raise BadInput(
                f"{field!r} has {length} values and the others have {usual}",
                where=source,
                do="Put what is sampled together into a struct of its own, or store vectors of one length.",
            )
    names, units = named(headers, source)
    return Topic(name, dict(zip(names, fields.values(), strict=True)), units)


def _belongs(name: str, variable: str) -> bool:
    return name == variable or name.startswith((f"{variable}.", f"{variable}("))


def _short_names(names: list[str]) -> list[str]:
    """Names without the struct they share, if they still differ ("run.u", "run.v" become "u", "v")."""
    last = [name.rpartition(".")[2] for name in names]
    return last if len(set(last)) == len(last) else names

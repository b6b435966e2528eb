"""The catalogue of effects as the documents show it, written from the effects themselves so that it cannot drift."""

from __future__ import annotations

from collections.abc import Iterable

from seatruth.effects.base import Effect

_COLUMNS = (
    "#",
    "effect",
    "cause",
    "equation",
    "parameters: typical",
    "acts on",
    "never distinguished from",
    "confused with: distinguished by",
)


def ordered(effects: Iterable[Effect]) -> list[Effect]:
    """By number in the catalogue, those without one last; then by name."""
    return sorted(effects, key=lambda effect: (effect.number or 1_000, effect.name))


def markdown(effects: Iterable[Effect]) -> str:
    """A table of effects."""
    rows = [_COLUMNS, tuple("---" for _ in _COLUMNS), *(_row(effect) for effect in ordered(effects))]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _row(effect: Effect) -> tuple[str, ...]:
    apart = ", ".join(f"`{name}`" for name in effect.confused_with)
    return (
        str(effect.number or ""),
        f"`{effect.name}` {effect.title}",
        effect.cause,
        _plain(effect.equation),
        "; ".join(_parameter(effect, q.name) for q in effect.parameters),
        ", ".join(effect.acts_on) + (f" of {', '.join(effect.kinds)} only" if effect.kinds else ""),
        ", ".join(f"`{name}`" for name in effect.equivalent),
        _plain(f"{apart}: {effect.distinguished_by}" if apart else effect.distinguished_by),
    )


def _parameter(effect: Effect, name: str) -> str:
    """A parameter with its null where that is not zero, and its typical distance from it, by kind where they differ.

    A shape parameter with the mean and the standard deviation of its prior.
    """
    q = next(q for q in effect.parameters if q.name == name)
    null, unit = effect.null[name], "" if q.unit == "1" else f" {q.unit}"
    if q.prior is not None:
        return f"`{name}` shape {q.prior.mean:g} ± {q.prior.sd:g}{unit}"
    kinds = {kind: values[name] for kind, values in effect.typical_by_kind.items() if name in values}
    size = [f"{abs(q.value - null):.3g}", *(f"{kind} {value:.3g}" for kind, value in kinds.items())]
    about = f", null {null:g}{unit}" if null else ""
    return f"`{name}` {', '.join(size)}{unit}{about}"


def _plain(text: str) -> str:
    """Text that a cell of a table can hold."""
    return text.replace("|", "\\|")

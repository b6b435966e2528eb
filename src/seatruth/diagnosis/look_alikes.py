"""What the gap looks like, and is not said to be, in sentences with the reason."""

from __future__ import annotations

from collections.abc import Sequence

from seatruth.text import listed

_FIRST = 4
"""How many of a long list of effects are named. [S]"""
_SOUND = " A vehicle with nothing wrong often differs so from its model."


def of_another_form(titles: Sequence[str], curve: Sequence[str], *, damping: bool) -> str:
    """What fits, where another form of the model's forces would fit as well, or the form itself.

    All of it may be `damping`, which is no sign that anything is wrong. Forces on one side are: a hull has none.
    """
    sound = _SOUND if damping else ""
    if titles:
        other = curve or ["damping or drag of another form than the model's"]
        together = ", alone or together" if len(titles) > 1 else ""
        return f"It looks like {listed(titles)}{together}, or like {listed(other)}.{sound}"
    return f"It looks like {listed(curve)}.{sound}" if curve else ""


def part_of_it(titles: Sequence[str]) -> str:
    """What fits, where forces are missing beside it, of which it may be a part."""
    if not titles:
        return ""
    them = "it" if len(titles) == 1 else "them"
    return (
        f"It looks like {listed(titles)}, but forces of unknown cause are missing beside {them}: a model of another "
        "form looks the same."
    )


def unpredictive(titles: Sequence[str]) -> str:
    """What explains the trials, and does not surely predict those left out."""
    if not titles:
        return ""
    do = "does" if len(titles) == 1 else "do"
    return f"It looks like {listed(titles)}, which {do} not surely predict trials left out."


def of_kinds(titles: Sequence[str]) -> str:
    """A list of effects of all kinds, the first of them by name."""
    if not titles:
        return ""
    more = len(titles) - _FIRST
    shown = [*titles[:_FIRST], f"one of {more} others"] if more > 1 else titles
    return f"It looks like {' or '.join(shown)}, of which none is probable by itself."


def on_one_course(titles: Sequence[str]) -> str:
    """What fits, where trials on one course cannot tell it from a force of the vehicle's own."""
    if not titles:
        return ""
    return f"It looks like {listed(titles)}, which trials on one course cannot tell from forces that the model lacks."


def outdone(titles: Sequence[str], *, beside: bool) -> str:
    """What explains the trials, alone or beside named causes, where those left out are predicted better without it."""
    them = "it" if len(titles) == 1 else "them"
    return _looks(titles, f", but trials left out do not bear {them} out: the model is of another form.", beside=beside)


def untried(titles: Sequence[str], *, beside: bool) -> str:
    """What explains the trials, where what cannot be tried on the model may do so as well."""
    return _looks(titles, ", or like a force that cannot be tried on this model.", beside=beside)


def drifting(titles: Sequence[str], *, beside: bool) -> str:
    """What explains the trials, where a vehicle that drifts otherwise in turns than its model does so as well."""
    return _looks(titles, "; a vehicle that drifts a little otherwise in turns shows the same.", beside=beside)


def turning(titles: Sequence[str], *, beside: bool) -> str:
    """Delays of the heading and of the rate of turn, where a steering that acts as much later shows them as well."""
    return _looks(titles, "; where both are equal, a steering that acts as much later shows the same.", beside=beside)


def _looks(titles: Sequence[str], reason: str, *, beside: bool) -> str:
    return f"{'The rest' if beside else 'It'} looks like {listed(titles)}{reason}" if titles else ""

"""A matplotlib figure as SVG that can stand in an HTML page: small, no ids that clash, the same bytes each time."""

from __future__ import annotations

import io
import re
import warnings
from html import escape

from matplotlib.figure import Figure

from seatruth.report.figures.style import styled

_METADATA = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->|<style[^>]*>.*?</style>", re.DOTALL)
_USED = re.compile(r'(?:url\(#|href="#)([^)"]+)')
_ID = re.compile(r' id="([^"]+)"')
_TICK = re.compile(r' id="([xy])tick_\d+"')
_ZOOM = re.compile(r' id="zoom ([^"|]*)\|([^"]*)"')
_TRACE = re.compile(r' id="trace ([^"]*)"')
"""What `style.zoomable` and `style.trace` leave in the drawing for the page's script."""
_PATH = re.compile(r' d="([^"]*)"')
_DECIMALS = re.compile(r"-?\d+\.\d{2,}")
_BLANK = re.compile(r">\s*\n\s*<")
_GROUP = re.compile(r"<g>\s*</g>")


@styled
def svg(figure: Figure, alt: str, key: str) -> str:
    """The figure as one <svg> element with `alt` as its description; `key` is unique in the page.

    Text stays text. Coordinates have one decimal: a tenth of a point.
    """
    stream = io.StringIO()
    with warnings.catch_warnings():
        # A name in a script that the measuring font lacks is still drawn, by the reader's fonts.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        nothing = {"Date": None, "Creator": None, "Format": None, "Type": None}
        figure.savefig(stream, format="svg", metadata=nothing)
    whole = stream.getvalue()
    start = whole.index("<svg ")
    open_end = whole.index(">", start) + 1
    size = _sizes(whole[start:open_end])
    body = _METADATA.sub("", whole[open_end:])
    body = _TICK.sub(r' class="tick \1"', body)
    body = _ZOOM.sub(r' data-box="\1" data-link="\2"', body)
    body = _TRACE.sub(r' data-trace="\1"', body)
    used = set(_USED.findall(body))
    body = _ID.sub(lambda match: f' id="{key}-{match[1]}"' if match[1] in used else "", body)
    body = re.sub(r"url\(#", f"url(#{key}-", body)
    body = re.sub(r'(?:xlink:)?href="#', f'href="#{key}-', body).replace("xlink:href", "href")
    body = _PATH.sub(lambda match: f' d="{_shorter(match[1])}"', body)
    body = _GROUP.sub("", _BLANK.sub("><", body))
    return f'<svg class="plot" role="img" aria-label="{escape(alt, quote=True)}" {size}>{body.strip()}'


def _sizes(tag: str) -> str:
    found = {name: re.search(rf'\b{name}="([^"]+)"', tag) for name in ("width", "height", "viewBox")}
    return " ".join(f'{name}="{match[1]}"' for name, match in found.items() if match)


def _shorter(path: str) -> str:
    rounded = _DECIMALS.sub(lambda match: f"{float(match[0]):.1f}", path)
    return re.sub(r"\s+", " ", rounded).strip()

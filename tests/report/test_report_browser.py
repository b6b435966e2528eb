"""Reports in a real browser: no error, no request, zoom and sort, a phone's screen, paper."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pytest
from browser import ask, needs_chromium, printed
from fake_diagnosis import diagnosis
from fake_estimate import estimate
from fake_prediction import prediction

sys.path.insert(0, str(Path(__file__).parents[1] / "comparison"))
from small_comparison import line, small

from seatruth import Budget, compare, identify, sample, write_report
from seatruth.report.comparison import write_comparison_report
from seatruth.report.log_map import log_map
from seatruth.report.prediction import write_prediction_report
from seatruth.trials.stretches import by_events

pytestmark = [pytest.mark.slow, needs_chromium]

NAMES = ("estimate", "formula", "diagnosis", "comparison", "prediction", "map")
"""Every kind of page that seatruth writes."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    found = {}
    formula = identify(line(), budget=Budget(evaluations=60), threads=1)
    for name, result in (("estimate", estimate()), ("formula", formula), ("diagnosis", diagnosis())):
        found[name] = folder / f"{name}.html"
        write_report(result, found[name])
    found["comparison"] = folder / "comparison.html"
    write_comparison_report(compare(small(), folder / "store"), found["comparison"])
    found["prediction"], found["map"] = folder / "prediction.html", folder / "map.html"
    write_prediction_report(prediction(), found["prediction"])
    log = sample.load().trials[0]
    parts = by_events(log.t, [40.0, 90.0])
    found["map"].write_text(log_map(log, parts, [part.name for part in parts], "events"), encoding="utf-8")
    return found


USE = """
  const before = performance.now();
  const plot = page.querySelector("figure [data-box]").closest("figure");
  const line = plot.querySelector("[data-trace=fitted] path");
  const seen = text => text.getBoundingClientRect().width > 0;
  const texts = () => [...plot.querySelectorAll("text")].filter(seen).map(text => text.textContent);
  const as_drawn = { box: line.getBoundingClientRect().width, texts: texts() };
  plot.querySelector("[aria-label='Zoom in']").click();
  const zoomed = { box: line.getBoundingClientRect().width, texts: texts() };
  plot.querySelector("[aria-label='Show the whole plot']").click();
  const whole = { box: line.getBoundingClientRect().width, texts: texts() };
  const toggle = [...plot.querySelectorAll(".tools label")].find(label => label.textContent.trim() === "fitted");
  toggle.querySelector("input").click();
  const hidden = line.getBoundingClientRect().width;
  toggle.querySelector("input").click();
  const shown = line.getBoundingClientRect().width;
  return { as_drawn, zoomed, whole, hidden, shown, requests: inner.performance.getEntriesByType("resource").length };
"""


def test_plots_zoom_and_traces_hide(pages: dict[str, Path]) -> None:
    found, logged = ask(pages["estimate"], USE)
    assert "error" not in found, found
    assert logged == []
    assert found["requests"] == 0
    assert found["zoomed"]["box"] == pytest.approx(2 * found["as_drawn"]["box"], rel=0.02)
    assert found["zoomed"]["texts"] != found["as_drawn"]["texts"], "ticks follow the zoom"
    assert found["whole"] == found["as_drawn"]
    assert (found["hidden"], found["shown"]) == (0, found["as_drawn"]["box"])


DRAG = """
  const group = page.querySelector("figure [data-box]"), plot = group.closest("svg");
  const area = group.querySelector("path").getBoundingClientRect();
  const line = group.querySelector("[data-trace=fitted] path");
  const was = line.getBoundingClientRect().width;
  const fire = (target, kind, x) => target.dispatchEvent(new inner.PointerEvent(kind,
    { clientX: x, clientY: area.top + area.height / 2, bubbles: true, pointerType: "mouse", button: 0 }));
  fire(plot, "pointerdown", area.left + 0.25 * area.width);
  fire(inner, "pointermove", area.left + 0.5 * area.width);
  fire(inner, "pointerup", area.left + 0.5 * area.width);
  const now = line.getBoundingClientRect().width;
  const linked = [...plot.querySelectorAll("[data-link=t] [data-trace=residual] path")]
    .map(residual => residual.getBoundingClientRect().width / was);
  plot.dispatchEvent(new inner.MouseEvent("dblclick"));
  return { factor: now / was, linked, back: line.getBoundingClientRect().width / was };
"""


def test_dragging_zooms_all_panels_of_a_trial_and_a_double_click_goes_back(pages: dict[str, Path]) -> None:
    found, logged = ask(pages["estimate"], DRAG)
    assert logged == []
    assert found["factor"] == pytest.approx(4.0, rel=0.05)
    assert found["linked"]
    assert found["linked"][0] == pytest.approx(4.0, rel=0.1)
    assert found["back"] == pytest.approx(1.0)


SORT = """
  const table = [...page.querySelectorAll("table")].find(t => t.tBodies[0].rows.length > 3
    && t.tHead.rows[0].querySelector("th.number"));
  const column = [...table.tHead.rows[0].cells].findIndex(cell => cell.classList.contains("number"));
  const cells = () => [...table.tBodies[0].rows].map(row => row.cells[column].textContent.trim());
  const click = () => table.tHead.rows[0].cells[column].querySelector("button").click();
  const first = cells(); click(); const up = cells(); click(); const down = cells(); click();
  return { first, up, down, again: cells() };
"""


def value(text: str) -> float:
    found = re.search(r"-?\d+(\.\d+)?(e[-+]?\d+)?", text.replace("\N{MINUS SIGN}", "-"), re.IGNORECASE)
    assert found is not None, text
    return float(found[0])


def test_a_click_on_a_head_sorts_by_its_numbers(pages: dict[str, Path]) -> None:
    found, logged = ask(pages["estimate"], SORT)
    assert logged == []
    numbers = [value(text) for text in found["up"] if text]
    assert numbers == sorted(numbers)
    assert [value(text) for text in found["down"] if text] == sorted(numbers, reverse=True)
    assert found["first"] == found["again"]
    assert sorted(found["first"]) == sorted(found["up"])


EVERY = """
  const wrong = [];
  let zoomed = 0, sorted = 0, toggled = 0;
  for (const plot of new Set([...page.querySelectorAll("figure [data-box]")].map(box => box.closest("figure")))) {
    const size = () => [...plot.querySelectorAll("[data-box] path")].map(path => path.getBoundingClientRect().width);
    const before = size();
    plot.querySelector("[aria-label='Zoom in']").click();
    if (!size().some((width, k) => width > 1.5 * before[k])) wrong.push("no zoom: " + plot.textContent.slice(0, 60));
    plot.querySelector("[aria-label='Show the whole plot']").click();
    if (size().some((width, k) => Math.abs(width - before[k]) > 0.5)) wrong.push("not whole again");
    for (const toggle of plot.querySelectorAll(".tools input")) {
      const name = toggle.parentElement.textContent.trim();
      const lines = [...plot.querySelectorAll("[data-trace]")].filter(line => line.dataset.trace === name);
      const hidden = () => lines.filter(line => inner.getComputedStyle(line).display === "none").length;
      toggle.click();
      if (!lines.length || hidden() !== lines.length) wrong.push("still there: " + name);
      toggle.click();
      if (hidden()) wrong.push("not back: " + name);
      toggled += 1;
    }
    zoomed += 1;
  }
  for (const table of page.querySelectorAll("table")) {
    const rows = () => [...table.tBodies].flatMap(body => [...body.rows]).map(row => row.textContent);
    const before = rows();
    for (const button of table.querySelectorAll("thead button")) {
      for (let k = 0; k < 3; k++) {
        button.click();
        if ([...rows()].sort().join() !== [...before].sort().join()) wrong.push("rows change: " + button.textContent);
      }
      if (rows().join() !== before.join()) wrong.push("the third click does not go back: " + button.textContent);
      sorted += 1;
    }
  }
  const outside = [...page.querySelectorAll("[src], link[href]")].map(node => node.src || node.href)
    .filter(address => !address.startsWith("data:"));
  return { wrong, zoomed, sorted, toggled, outside, requests: inner.performance.getEntriesByType("resource").length };
"""


@pytest.mark.parametrize("name", NAMES)
def test_each_plot_zooms_each_column_sorts_and_nothing_is_asked_for(pages: dict[str, Path], name: str) -> None:
    found, logged = ask(pages[name], EVERY)
    assert logged == []
    assert (found["wrong"], found["outside"], found["requests"]) == ([], [], 0)
    assert found["sorted"] > 3
    assert found["zoomed"] > 0 or name in ("formula", "comparison")
    assert found["toggled"] > 1 or name not in ("estimate", "prediction", "map")


NARROW = """
  const beyond = [...page.querySelectorAll("body *")].filter(node => {
    const box = node.getBoundingClientRect();
    return box.width > 0 && (box.right > 390.5 || box.left < -0.5) && !node.closest(".skip, figure.wide");
  }).map(node => `${node.tagName}: ${node.textContent.trim().slice(0, 40)}`);
  const own = [...page.querySelectorAll("figure.wide")].filter(
    figure => getComputedStyle(figure).overflowX !== "auto" || figure.getBoundingClientRect().right > 390.5);
  for (const table of page.querySelectorAll("details")) table.open = true;
  const scrolled = [...page.querySelectorAll(".scroll")].filter(box => box.scrollWidth > box.clientWidth)
    .map(box => box.getAttribute("aria-label"));
  return { wide: page.documentElement.scrollWidth, beyond, own: own.length, scrolled };
"""
"""Nothing is beyond the screen; figures that need more room are scrolled in their own frame, tables are not."""


@pytest.mark.parametrize("name", NAMES)
def test_nothing_leaves_the_screen_of_a_phone(pages: dict[str, Path], name: str) -> None:
    found: Any
    found, logged = ask(pages[name], NARROW, width=390)
    assert logged == []
    assert found == {"wide": 390, "beyond": [], "own": 0, "scrolled": []}


CARDS = """
  const table = page.querySelector("table.cards:has(.sort)");
  const first = () => table.tBodies[0].rows[0].cells[0].textContent;
  const buttons = [...table.tHead.querySelectorAll(".sort")];
  const seen = buttons.filter(button => button.getBoundingClientRect().width > 0).length;
  const before = first();
  buttons[0].click(); const up = first(); buttons[0].click();
  return { seen, all: buttons.length, before, up, down: first() };
"""


def test_cards_of_a_phone_can_be_sorted(pages: dict[str, Path]) -> None:
    found, logged = ask(pages["estimate"], CARDS, width=390)
    assert logged == []
    assert found["seen"] == found["all"] > 2
    assert found["up"] < found["down"]


@pytest.mark.parametrize("name", NAMES)
def test_paper_has_every_figure(pages: dict[str, Path], name: str) -> None:
    figures = pages[name].read_text(encoding="utf-8").count('<svg class="plot"')
    assert figures > (3 if name in ("estimate", "diagnosis") else 1)
    assert len(re.findall(rb"/S\s*/Figure", printed(pages[name]))) >= figures


NUMBERS = """
  const plot = page.querySelector("figure [data-box]").closest("figure");
  const label = [...plot.querySelectorAll("[data-box] [clip-path] text")].find(text => text.textContent.trim() === "2");
  const marker = [...plot.querySelectorAll("[data-box] [clip-path] use")][1];
  const apart = () => {
    const [a, b] = [label, marker].map(node => node.getBoundingClientRect());
    return [a.left - b.left, a.top - b.top, a.height];
  };
  const before = apart();
  plot.querySelector("[aria-label='Zoom in']").click();
  return { before, after: apart() };
"""


def test_the_number_of_a_stretch_stays_at_its_start_when_its_map_is_zoomed(pages: dict[str, Path]) -> None:
    found, logged = ask(pages["map"], NUMBERS)
    assert logged == []
    assert found["after"] == pytest.approx(found["before"], abs=0.6)

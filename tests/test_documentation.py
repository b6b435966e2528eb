"""The site is put together so that links hold, and what is written from code reads as it should."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tools" / "documentation"))
import assemble  # noqa: E402  (the folder of tools is no package)
import built  # noqa: E402
import codes_pages  # noqa: E402
import effects_pages  # noqa: E402
import optimizers_page  # noqa: E402
import reference_pages  # noqa: E402
import withheld_picture  # noqa: E402

from seatruth import cli, load_model, minimise, models, optimizers, sample  # noqa: E402
from seatruth.codes import Cause, Code  # noqa: E402
from seatruth.commands.list_installed import Kind  # noqa: E402
from seatruth.effects import available  # noqa: E402
from seatruth.testing.problems import linear_regression  # noqa: E402


def test_links_lead_to_pages_of_the_site_pictures_come_along_and_other_files_keep_their_names(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    source, other = tmp_path / "docs" / "page.md", tmp_path / "README.md"
    other.write_text("")
    (tmp_path / "picture.png").write_bytes(b"x")
    (tmp_path / "Makefile").write_text("")
    source.write_text("[start](../README.md#start) ![a](../picture.png) [make](../Makefile) [out](https://a.org/b)")
    site = tmp_path / "site"
    places = {source: site / "page.md", other: site / "project" / "readme.md"}
    site.mkdir()
    text = assemble.relinked(source, places[source], places)
    assert text == "[start](project/readme.md#start) ![a](figures/picture.png) `make` [out](https://a.org/b)"
    assert (site / "figures" / "picture.png").exists()
    source.write_text("[gone](../gone.md)")
    with pytest.raises(ValueError, match=r"page.md: the link to ../gone.md leads nowhere"):
        assemble.relinked(source, places[source], places)


@pytest.mark.parametrize("page", sorted(ROOT.glob("docs/*/*.md")), ids=lambda page: f"{page.parent.name}/{page.name}")
def test_every_page_of_a_group_has_one_title(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    body = text.split("---\n", 2)[2] if text.startswith("---\n") else text
    outside = "".join(body.split("```")[::2])
    assert [line for line in outside.splitlines() if line.startswith("# ")], "a page begins with its title"


def test_the_site_has_what_it_promises() -> None:
    assert len([page for page in (ROOT / "docs" / "tutorials").glob("*.md") if page.name != "index.md"]) >= 5
    assert len([page for page in (ROOT / "docs" / "how-to").glob("*.md") if page.name != "index.md"]) >= 12
    assert len([page for page in (ROOT / "docs" / "explanations").glob("*.md") if page.name != "index.md"]) >= 5


def test_a_tutorial_that_does_not_show_its_figure_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "tutorials").mkdir()
    for name in built.PICTURED:
        (tmp_path / "tutorials" / f"{name}.html").write_text('<img alt="a" src="../_images/a.png" />')
    assert built.lacking(tmp_path) == []
    (tmp_path / "tutorials" / "formula.html").write_text("<pre>&lt;Figure size 480x430 with 1 Axes&gt;</pre>")
    (tmp_path / "tutorials" / "comparison.html").write_text("<pre>?25l</pre>")
    assert built.lacking(tmp_path) == [
        "comparison: control characters of a terminal",
        "formula: a figure that is not shown",
        "formula: no picture",
    ]


def test_the_benchmark_has_a_picture_of_its_published_scores(tmp_path: Path) -> None:
    page = tmp_path / "experiments.md"
    page.write_text((ROOT / "experiments" / "README.md").read_text(encoding="utf-8"), encoding="utf-8")
    before = page.read_text(encoding="utf-8")
    withheld_picture.insert(page)
    assert "](figures/withheld.svg)" in page.read_text(encoding="utf-8")
    assert (tmp_path / "figures" / "withheld.svg").stat().st_size > 1000
    assert len(page.read_text(encoding="utf-8").splitlines()) == len(before.splitlines()) + 4
    section = (
        "| measure | goal | all 9 cases (95 % interval) |  | limit |\n| --- | --- | --- | --- | --- |\n"
        "| named right | >= 0.9 | 0.67 (0.30 to 0.90) | 4 of 6 | 1.00 |\n"
        "| no goal |  | 0.20 (0.04 to 0.62) | 1 of 5 |  |\n\n| measure | said |\n| --- | --- |\n| a | b |\n"
    )
    (scored,) = withheld_picture.tables(section)
    assert scored.title == "all 9 cases"
    assert scored.rows == {"named right": (">= 0.9", 0.67, 0.3, 0.9)}
    page.write_text("## withheld\n\nNothing yet.\n")
    with pytest.raises(ValueError, match="no table"):
        withheld_picture.insert(page)


def test_the_gallery_says_what_each_of_its_pages_shows() -> None:
    text = (ROOT / "docs" / "gallery" / "index.md").read_text(encoding="utf-8")
    about, _, tree = text.partition("```{toctree}")
    pages = [line for line in tree.splitlines() if line and not line.startswith((":", "`"))]
    assert len(pages) == len([line for line in about.splitlines() if line.startswith("- ")]) >= 9


def test_a_page_of_a_code_shows_causes_and_remedies_as_they_are() -> None:
    text = codes_pages.page(Code("odd", "finding", "About *it*.", [Cause("a | b {name}", "Do `x_y`.", "note")]))
    assert "| note | a \\| b \\{name\\} | Do `x_y`. |" in text
    assert "About \\*it\\*." in text


def test_the_gallery_shows_every_effect_and_what_it_is_confused_with(tmp_path: Path) -> None:
    known = available()
    thrusters = {"thruster_direction", "thruster_lag", "voltage_sag", "battery_discharge", "tether"}
    parameters = {parameter.name for name in models.available() for parameter in load_model(name).parameters}
    parameters.add("N_delta")  # of models of one's own
    for name, effect in known.items():
        runs = [made[0].name for made in effects_pages.shown_on(effect)]
        assert runs or name in effects_pages._NOISE, f"no run shows {name}"
        if name in thrusters:
            assert runs == ["twin_thruster", "bluerov2"]
        assert {*effect.confused_with, *effect.equivalent} <= {*known, *parameters}, name


@pytest.mark.parametrize("name", ["rudder_lag", "trial_current", "thruster_gain"])
def test_an_effect_has_a_picture_of_what_it_changes_on_each_vehicle(name: str, tmp_path: Path) -> None:
    known = available()
    text = effects_pages.page(known[name], known, tmp_path)
    pictures = re.findall(r"!\[[^\]]*\]\((\S+)\)", text)
    assert len(pictures) == len(effects_pages.shown_on(known[name]))
    assert all((tmp_path / picture).stat().st_size > 1000 for picture in pictures)
    assert all(f"[{other}]({other}.md)" in text for other in known[name].confused_with if other in known)


def test_the_page_on_look_alikes_shows_two_that_part_where_the_revolutions_change(tmp_path: Path) -> None:
    page = tmp_path / "look_alikes.md"
    page.write_text((ROOT / "docs" / "explanations" / page.name).read_text(encoding="utf-8"))
    effects_pages.write_pair(page)
    assert "](look_alikes.svg)" in page.read_text(encoding="utf-8")
    assert (tmp_path / "look_alikes.svg").stat().st_size > 1000
    with pytest.raises(ValueError, match="has no place for its picture"):
        effects_pages.write_pair(page)
    assert effects_pages.PAIR[1] in available()[effects_pages.PAIR[0]].confused_with
    upper, lower = effects_pages.pair_signatures()[0].axes
    t, difference = lower.lines[-1].get_data()
    early = t < effects_pages._ALIKE_UNTIL
    signature = upper.lines[-1].get_ydata()
    assert max(abs(difference[early])) < 0.1 * max(abs(signature[early]))
    assert max(abs(difference[~early])) > 0.2 * max(abs(signature[~early]))


@pytest.mark.parametrize("name", effects_pages._NOISE)
def test_noise_has_a_picture_of_what_it_makes_of_a_record(name: str, tmp_path: Path) -> None:
    text = effects_pages.page(available()[name], available(), tmp_path)
    assert "**Confused with**: " in text
    assert f"![What {name} does to a record]({name}.svg)" in text
    records, noises = (
        [line.get_ydata() for line in axes.get_lines()]
        for axes in effects_pages.noise_signature(available()[name]).axes
    )
    if name == "quantisation":
        assert len(set(records[1])) < 0.5 * len(set(records[0]))
    elif name == "outliers":
        assert max(abs(noises[1])) > 2 * max(abs(noises[0]))
    else:
        alone, noisy = ((y[1:] @ y[:-1]) / (y @ y) for y in noises)
        assert noisy > alone + 0.2


@pytest.mark.slow
def test_every_solver_has_two_test_functions(tmp_path: Path) -> None:
    optimizers_page.write(tmp_path)
    text = (tmp_path / "optimizers.md").read_text(encoding="utf-8")
    functions = text.partition("## What each one is")[0]
    for name in optimizers.available():
        assert len([line for line in functions.splitlines() if line.startswith("|") and f"| `{name}` |" in line]) >= 2
    for known in (optimizers_page.collinear(), linear_regression()):
        assert minimise(known.cost, "least_squares", seed=1).value == pytest.approx(known.value)


def test_every_model_and_solver_has_its_entry_in_the_reference() -> None:
    for kind, names in ((Kind.models, models.available()), (Kind.optimizers, optimizers.available())):
        text = reference_pages._entries(kind, "Title", "About.")
        assert len(names) >= 10
        assert [name for name in names if f"\n## {name}\n" not in text] == []


def test_the_reference_of_json_calls_every_command(tmp_path: Path) -> None:
    assert {*reference_pages._CALLS, "demo"} == {*cli.COMMANDS}
    sample.copy_to(tmp_path)
    for command in ("init", "trials", "list"):
        answer = reference_pages._answer(command, reference_pages._CALLS[command].split(), tmp_path)
        assert answer["command"] == command
        assert "result: object" in reference_pages.layout(answer)
    with pytest.raises(RuntimeError, match="seatruth explain ended with 2"):
        reference_pages._answer("explain", ["explain", "nothing-known"], tmp_path)


def test_a_docstring_becomes_markdown() -> None:
    doc = "Does it.\n\nArgs:\n    speed: In m/s.\n\nExample:\n    >>> 1 + 1\n    2\n"
    assert reference_pages.document(doc) == (
        "Does it.\n\n**Args**\n\n- `speed`: In m/s.\n\n**Example**\n\n```pycon\n>>> 1 + 1\n2\n```\n\n"
    )

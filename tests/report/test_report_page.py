"""The page: every section, nothing loaded from elsewhere, well formed, the same bytes, odd inputs survived."""

from __future__ import annotations

import dataclasses
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fake_estimate import CHANNELS, brief, empty, estimate

from seatruth.report import render, write_report
from seatruth.statistics.posterior_sample import Ensemble
from seatruth.storage.atomic import CannotWrite
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Step

VOID = {"meta", "br", "link", "img", "input", "hr"}
SECTIONS = (
    *("summary", "parameters", "combinations", "correlation", "sensitivity", "fit", "histories", "tracks", "residuals"),
    *(
        "held-out",
        "cross-validation",
        "profile",
        "posterior",
        "search",
        "starts",
        "discretisation",
        "steps",
        "findings",
        "provenance",
    ),
)


class Page(HTMLParser):
    """Reads a page, insisting that its tags balance; keeps what the tests ask for."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open, f"left open: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open[-1] == tag, f"</{tag}> closes <{self.open[-1]}>"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def html() -> str:
    return render(estimate())


@pytest.fixture(scope="module")
def page(html: str) -> Page:
    return Page(html)


def test_every_section_is_there_in_the_order_of_reading(page: Page) -> None:
    assert tuple(section["id"] for section in page.all("section")) == SECTIONS
    targets = [str(link["href"])[1:] for link in page.all("a")]
    assert set(targets) <= set(SECTIONS)
    assert targets[1 : 1 + len(SECTIONS)] == list(SECTIONS)


def test_nothing_is_loaded_from_elsewhere(html: str, page: Page) -> None:
    names = html.replace('"http://www.w3.org/2000/svg"', "")  # the name of a format, which nothing loads
    assert not re.search(r"https?://|//[a-z]|@import|<link|<iframe", names)
    assert [attributes for tag, attributes in page.tags if tag == "script"] == [{}], "its own, without a source"
    for _, attributes in page.tags:
        for name in ("src", "href", "xlink:href", "data", "action"):
            value = attributes.get(name)
            assert value is None or value.startswith(("#", "data:image/png;base64,"))
    for reference in re.findall(r"url\(([^)]*)\)", html):
        assert reference.startswith("#")


def test_ids_are_unique_and_every_reference_has_its_target(html: str, page: Page) -> None:
    ids = [str(attributes["id"]) for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    used = set(re.findall(r'url\(#([^)]+)\)|href="#([^"]+)"', html))
    assert {a or b for a, b in used} <= set(ids)


def test_same_estimate_gives_the_same_bytes(tmp_path: Path) -> None:
    write_report(brief(), tmp_path / "deep" / "report.html")
    assert (tmp_path / "deep" / "report.html").read_bytes() == render(brief()).encode()
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["report.html"]


def test_page_of_the_size_of_the_sample_is_small(html: str) -> None:
    assert len(html.encode()) < 1.5e6


def test_readable_without_seeing_it(page: Page) -> None:
    plots = [attributes for attributes in page.all("svg") if attributes.get("class") == "plot"]
    assert len(plots) > 40
    assert all(attributes["role"] == "img" and len(str(attributes["aria-label"])) > 20 for attributes in plots)
    assert page.all("html")[0]["lang"] == "en"
    assert len(page.all("h1")) == 1
    assert all(attributes.get("scope") in ("row", "col") for attributes in page.all("th"))
    assert all(attributes.get("aria-label") for attributes in page.all("nav"))
    assert len(page.all("caption")) == len(page.all("table"))


@pytest.mark.usefixtures("undrawn")
def test_synthetic_data_are_said_to_be_synthetic(page: Page) -> None:
    assert "SYNTHETIC" in page.text
    assert "SYNTHETIC" not in Page(render(brief(synthetic=False))).text


def test_angles_are_in_degrees(page: Page) -> None:
    assert "psi (deg)" in page.text
    assert "r (deg/s)" in page.text
    assert "rad" not in page.text.split()


def test_verdict_names_what_is_known_and_what_is_not(page: Page) -> None:
    assert "The search converged after 412 evaluations in 3.2 s" in page.text
    assert "6 of 12 free parameters are identified" in page.text
    assert "Y_v and N_vrr are only weakly identified" in page.text
    assert "Y_vrr stopped at a bound" in page.text
    assert "follows u, v and r to within the noise" in page.text


@pytest.mark.usefixtures("undrawn")
def test_value_has_the_digits_of_its_error(page: Page) -> None:
    made = brief()
    made.parameters.loc["R_0", ["value", "stderr", "lower", "upper"]] = [0.123456789, 0.0023, 0.1189, 0.128]
    text = Page(render(made)).text
    assert "0.1235 N 0.0023 0.1189 to 0.1280 identified" in text


def test_the_tags_of_sources_are_explained(page: Page) -> None:
    assert "[L] model tests" in page.text
    assert "Tags: [L] other literature." in page.text


def test_steps_findings_and_provenance_are_shown(page: Page) -> None:
    assert "psi: 2 jumps of a full turn removed" in page.text
    assert "r stands still for 12 samples." in page.text
    assert "ab" * 32 in page.text
    assert "machine cpu unknown, cores 4" in page.text


def test_names_with_html_or_mathematics_in_them_stay_text() -> None:
    evil = '<script>alert("x")</script> & $\\frac{1}{2}$ \'"'
    made = estimate(parameters=3, trials=1, samples=80)
    made.study, made.model = evil, evil
    names = [evil, "Y_v", "N_v"]
    for table in (made.parameters, made.sensitivity):
        table.index = pd.Index(names)
    made.correlation = made.correlation.iloc[:3, :3].set_axis(names).set_axis(names, axis=1)
    made.traces["trial"] = evil
    made.traces["held_out"] = False
    made.fit["trial"] = evil
    made.outcome["reason"] = evil
    made.identifiability["weak"][0] |= {"sentence": evil, "combination": {evil: 1.0}}
    made.steps = [(evil, Step(evil, {evil: evil}, evil))]
    made.findings = [Finding("error", evil, evil, evil, evil, evil, evil)]
    made.profile = {evil: pd.DataFrame({"value": [0.0, 1.0, 2.0], "cost": [1.0, 0.0, 1.0]})}
    made.provenance = {evil: {evil: evil}}
    html = render(made)
    assert html.count("<script") == 1, "its own"
    assert "alert" in Page(html).text
    assert all("onload" not in name for _, attributes in Page(html).tags for name in attributes)


@pytest.mark.slow
def test_many_trials_and_parameters_stay_readable_and_small() -> None:
    html = render(estimate(parameters=60, trials=20, samples=300))
    page = Page(html)
    assert len(html.encode()) < 3.5e6
    assert "of 21 trials, those that fit worst and best" in page.text
    assert "Of 60 parameters, the 40 with the strongest" in page.text
    assert "zigzag_20_10" in page.text


def test_estimate_with_nothing_in_it_gives_a_page() -> None:
    page = Page(render(empty()))
    assert "The search failed after 40 evaluations in 0.1" in page.text
    assert "Do not use the estimates." in page.text
    assert [section["id"] for section in page.all("section")] == ["summary", "search"]


def test_all_nan_gives_a_page() -> None:
    made = estimate(parameters=4, trials=1, samples=50)
    numbers = ["value", "stderr", "lower", "upper", "crlb", "start", "min", "max", "prior_mean", "prior_sd"]
    made.parameters[numbers] = np.nan
    made.nuisances[numbers] = np.nan
    made.fit[["rmse", "noise", "ratio", "bias", "n", "n_eff", "autocorrelation", "rmse_start"]] = np.nan
    made.traces[["measured", "fitted", "start"]] = np.nan
    for table in (made.correlation, made.covariance, made.sensitivity, made.history, made.cross_validation):
        columns = [name for name in table if name not in ("trial", "channel")]
        table[columns] = np.nan
    made.outcome |= {"evaluations": None, "wall_s": float("nan"), "diverged": None}
    made.discretisation = {name: {"error": np.nan, "noise": np.nan, "ratio": np.nan} for name in CHANNELS}
    page = Page(render(made))
    assert "nan" not in page.text.lower().split()
    assert "histories" not in [section["id"] for section in page.all("section")]


@pytest.mark.parametrize("value", [np.inf, *(pytest.param(v, marks=pytest.mark.slow) for v in (1e300, -1e-300))])
def test_extreme_values_give_a_page(value: float) -> None:
    made = estimate(parameters=3, trials=1, samples=60)
    made.parameters.loc["Y_v", ["value", "lower", "upper"]] = value
    made.parameters.loc["R_0", "stderr"] = value
    made.traces.loc[made.traces["channel"] == "u", "start"] = value
    made.fit.loc[0, ["rmse_start", "ratio"]] = value
    made.history.loc[0, "best"] = value
    Page(render(made))


def test_one_parameter_and_one_short_trial() -> None:
    page = Page(render(estimate(parameters=1, trials=1, samples=3)))
    ids = [section["id"] for section in page.all("section")]
    assert "correlation" not in ids
    assert "The parameter is identified." in page.text


@pytest.mark.usefixtures("undrawn")
def test_what_is_missing_is_left_out() -> None:
    made = estimate(parameters=2, trials=1, samples=60)
    made.cross_validation = made.profile = None
    made.findings, made.steps, made.discretisation = [], [], {}
    made.traces = made.traces[~made.traces["channel"].isin(["x", "y"])]
    made.fit = made.fit[~made.fit["held_out"]]
    ids = [section["id"] for section in Page(render(made)).all("section")]
    absent = {"cross-validation", "profile", "findings", "steps", "discretisation", "tracks", "held-out"}
    assert not absent & set(ids)


@pytest.mark.slow
def test_tables_indexed_by_trial_and_channel_read_the_same() -> None:
    plain, indexed = (estimate(parameters=2, trials=1, samples=40) for _ in range(2))
    indexed.fit = indexed.fit.set_index(["trial", "channel"])
    indexed.cross_validation = indexed.cross_validation.set_index(["trial", "channel"])
    indexed.discretisation = pd.DataFrame(indexed.discretisation).T
    assert render(plain) == render(indexed)


def test_a_report_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    target = tmp_path / "report.html"
    target.mkdir()
    with pytest.raises(CannotWrite, match="report"):
        write_report(empty(), target)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.usefixtures("undrawn")
def test_a_noise_estimated_from_the_residuals_is_said_to_test_nothing() -> None:
    made = brief()
    made.cost["noise"]["u"]["estimated"] = True
    text = Page(render(made)).text
    assert "The noise of u (RMSE" in text
    assert "their size tests nothing" in text
    assert "noise estimated from the residuals of u" in text


@pytest.mark.usefixtures("undrawn")
def test_findings_about_the_result_stand_in_the_summary_and_folders_do_not(page: Page) -> None:
    made = brief()
    made.findings = [Finding("warning", "not-at-minimum", "The search ended short.", "search", "Give it more.")]
    made.outcome["code"] = "converged"
    said = Page(render(made)).text
    assert "The search ended short. Give it more. Findings" in said
    assert "The search converged, but short of a minimum" in said
    assert "1 warning: a.csv, line 40: r stands still" in page.text
    assert "/home/me" not in page.text


@pytest.mark.usefixtures("undrawn")
def test_the_optima_of_the_starts_are_shown_and_doubts_stand_first(page: Page) -> None:
    assert "12 starts ended at 3 optima; 5 at the best." in page.text
    assert "1 start found no finite cost." in page.text
    made = brief()
    made.parameters["verdict"] = "doubtful"
    made.findings = [
        Finding("warning", "exclusive-optima", "2 optima explain the trials.", "search", "Give a prior."),
        Finding("note", "better-optimum", "The study's own start is worse.", "search"),
    ]
    text = Page(render(made)).text
    assert "Important: 2 optima explain the trials. Give a prior. Findings" in text
    assert "are doubtful, as what to look at first says" in text
    assert "Important: The study's own start" not in text


@pytest.mark.usefixtures("undrawn")
def test_a_misfit_is_not_laid_on_the_model_before_the_search_has_ended() -> None:
    made = brief()
    made.fit["ratio"] = 50.0
    assert "there the model leaves something out" in Page(render(made)).text
    made.outcome |= {"code": "budget", "reason": "the budget of 10 evaluations is used up"}
    text = Page(render(made)).text
    assert "The search stopped before it converged" in text
    assert "there the model leaves something out" not in text
    assert "Important: Give it more evaluations" in text


@pytest.mark.usefixtures("undrawn")
def test_a_regression_has_no_noise_of_the_channels_and_says_so() -> None:
    made = brief()
    made.fit[["noise", "ratio"]] = np.nan
    made.cost = {"kind": "regression", "noise": {"u_dot": {"sd": 0.1, "estimated": True}}}
    made.optimizer = {"name": "chain", "stages": [{"name": "genetic"}, {"name": "newton", "options": {"a": 1}}]}
    page = Page(render(made))
    assert "there is nothing to measure the misfit by" in page.text
    assert "standard errors allow for it" not in page.text
    assert "Optimizer genetic, then newton" in page.text
    assert "optimizer: stage 2: options a 1" in page.text


def test_intervals_by_posterior_and_profile_stand_beside_the_linear_ones() -> None:
    made = estimate(parameters=3, trials=1, samples=40)
    words = Page(render(made)).text
    assert "95 % by profile" in words
    assert "95 % by posterior" in words
    assert "32 walkers took 300 steps; the first 40 are left out" in words
    assert "130 autocorrelation times (at least 50 are needed), which is enough" in words
    assert "95 % of what 200 draws of the posterior predict lies in the blue band" in words
    assert "no measurement noise" in words
    assert made.posterior is not None
    made.posterior = dataclasses.replace(made.posterior, steps=80)
    assert "too short: do not rely on the intervals" in Page(render(made)).text
    made.posterior, made.ensemble = None, Ensemble("starts", 3, 0)
    words = Page(render(made)).text
    assert "95 % by posterior" not in words
    assert "3 ends of starts" in words

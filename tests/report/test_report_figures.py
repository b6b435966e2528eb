"""The figures show what the estimate says, in the units of the page, and leave matplotlib as they found it."""

from __future__ import annotations

import itertools
import pickle
import subprocess
import sys

import matplotlib
import numpy as np
import pandas as pd
import pytest
from fake_estimate import CHANNELS, empty, estimate
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from seatruth.comparison.ranks import Ranking
from seatruth.report import figures
from seatruth.report.figures.comparison import ranks
from seatruth.report.figures.runs import acf
from seatruth.report.figures.style import distinct, spaced, thinned
from seatruth.report.figures.svg import svg


@pytest.mark.parametrize("name", figures.__all__)
def test_every_figure_draws_with_data_and_without(name: str) -> None:
    before = dict(matplotlib.rcParams)
    for source in (estimate(trials=2, samples=120), empty()):
        figure = getattr(figures, name)(source)
        assert isinstance(figure, Figure)
        assert svg(figure, "a figure", "f1").startswith('<svg class="plot" role="img"')
    assert dict(matplotlib.rcParams) == before


def test_figures_do_not_load_pyplot() -> None:
    code = "import sys, seatruth.report; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_notebook_shows_a_figure_as_a_picture() -> None:
    formatters = pytest.importorskip("IPython.core.formatters", reason="IPython comes with the extra docs")
    figure = figures.traces(estimate(trials=1, samples=120), channels=["r"])
    shown, _ = formatters.DisplayFormatter().format(figure)
    assert shown["image/png"].startswith(b"\x89PNG")
    assert pickle.loads(pickle.dumps(figure))._repr_png_() == shown["image/png"], "another process can still show it"


def test_traces_show_measured_and_fitted_in_degrees() -> None:
    made = estimate(trials=1, samples=300)
    upper, lower = figures.traces(made, "zigzag_10_10", ["r"]).axes
    rows = made.traces[(made.traces["trial"] == "zigzag_10_10") & (made.traces["channel"] == "r")]
    measured, start, fitted = (line.get_ydata() for line in upper.lines[:3])
    np.testing.assert_allclose(measured, np.degrees(rows["measured"]))
    np.testing.assert_allclose(start, np.degrees(rows["start"]))
    np.testing.assert_allclose(fitted, np.degrees(rows["fitted"]))
    residual = lower.lines[-1].get_ydata()
    np.testing.assert_allclose(residual, np.degrees(rows["measured"] - rows["fitted"]))
    assert upper.get_ylabel() == "r (deg/s)"


def test_a_start_that_diverges_does_not_flatten_the_measured() -> None:
    made = estimate(trials=1, samples=300)
    made.traces["start"] = 1e9
    upper = figures.traces(made, "zigzag_10_10", ["u"]).axes[0]
    assert upper.get_ylim()[1] < 2.0


def test_tracks_have_equal_axes_that_hold_all_measured_points() -> None:
    made = estimate(trials=2, samples=600)
    for axes in figures.tracks(made).axes:
        assert axes.get_aspect() == 1.0
        trial = axes.get_title(loc="right")
        for channel, (low, high) in (("y", axes.get_xlim()), ("x", axes.get_ylim())):
            rows = made.traces[(made.traces["trial"] == trial) & (made.traces["channel"] == channel)]
            assert low <= rows["measured"].min() <= rows["measured"].max() <= high


def test_position_between_the_bounds() -> None:
    made = estimate(parameters=1)
    made.parameters[["value", "lower", "upper", "min", "max", "start"]] = [3.0, 2.0, 4.0, 0.0, 10.0, 5.0]
    drawn = [line.get_xdata()[0] for line in figures.parameters(made, against="bounds").axes[0].lines]
    assert {20.0, 30.0, 50.0} <= set(np.round(drawn, 9))


def test_autocorrelation_is_that_of_the_known_process() -> None:
    rng = np.random.default_rng(3)
    x = np.zeros(40_000)
    for i in range(1, len(x)):
        x[i] = 0.9 * x[i - 1] + rng.standard_normal()
    x[rng.random(len(x)) < 0.1] = np.nan
    np.testing.assert_allclose(acf(x)[:20], 0.9 ** np.arange(20), atol=0.05)


@given(
    st.integers(1, 4000),
    st.integers(5, 60),
    st.integers(0, 2**32 - 1),
    st.floats(0, 1),
)
@settings(max_examples=60, deadline=None)
def test_thinning_keeps_the_peaks_of_every_stretch_the_ends_and_the_gaps(
    n: int, buckets: int, seed: int, missing: float
) -> None:
    rng = np.random.default_rng(seed)
    t, y = np.cumsum(rng.random(n) + 0.01), rng.standard_normal(n)
    gap = int(missing * n)
    y[n // 3 : n // 3 + gap // 2] = np.nan
    kept = thinned(t, y, buckets)
    assert (np.diff(kept) > 0).all()
    assert kept[0] == 0
    assert kept[-1] == n - 1
    assert len(kept) <= 4 * buckets + 6
    if np.isfinite(y).any():
        assert np.nanmax(y[kept]) == np.nanmax(y)
        assert np.nanmin(y[kept]) == np.nanmin(y)
    known = np.isfinite(y)
    # Between two neighbours that are drawn as a line there is no gap.
    for a, b in itertools.pairwise(kept.tolist()):
        if known[a] and known[b]:
            assert known[a : b + 1].all()


def test_a_channel_with_fewer_samples_is_a_line_and_its_gaps_stay() -> None:
    t = np.arange(40.0)
    y = np.where(np.arange(40) % 2 == 1, np.nan, 1.0)
    assert spaced(t, y)[:39].tolist() == np.isfinite(y)[:39].tolist()
    y[10:17] = np.nan
    between = spaced(t, y)
    assert between[9:17].all(), "a gap"
    assert not between[[1, 7, 19, 37]].any()
    assert spaced(t, np.full(40, np.nan)).all()
    each = np.ones(40)
    each[5] = np.nan
    assert spaced(t, each).all(), "one sample that is missing among all others is a gap"


def test_a_log_of_half_the_rate_is_drawn_as_a_line() -> None:
    made = estimate(trials=1, samples=300)
    made.traces.loc[made.traces.index % 2 == 1, "measured"] = np.nan
    upper, lower = figures.traces(made, "zigzag_10_10", ["r"]).axes
    assert np.isfinite(upper.lines[0].get_ydata()[:-1]).all()
    assert np.isfinite(lower.lines[-1].get_ydata()[:-1]).all()
    assert np.isfinite(figures.tracks(made).axes[0].lines[0].get_ydata()[:-1]).all()


def test_svg_keeps_text_as_text_and_names_are_not_read_as_mathematics() -> None:
    made = estimate(parameters=2)
    made.parameters.index = ["$x_2$", "<b>&"]
    text = svg(figures.parameters(made), 'say "hi" & <go>', "k7")
    assert "&lt;b&gt;&amp;" in text
    assert "$x_2$" in text
    assert 'aria-label="say &quot;hi&quot; &amp; &lt;go&gt;"' in text
    assert "http" not in text


def test_channels_without_a_known_unit_are_shown_as_they_are() -> None:
    made = estimate(trials=1, samples=60)
    del made.channels
    made.traces["channel"] = made.traces["channel"].replace({"u": "strange"})
    assert figures.traces(made, "zigzag_10_10", ["strange"]).axes[0].get_ylabel() == "strange"
    assert set(CHANNELS) - {"u"} <= set(made.traces["channel"])


def test_parameters_without_an_error_are_not_among_the_correlations() -> None:
    made = estimate(parameters=5)
    made.correlation.loc["Y_r", :] = np.nan
    made.correlation.loc[:, "Y_r"] = np.nan
    names = [label.get_text() for label in figures.correlation(made).axes[0].get_yticklabels()]
    assert names == ["R_0", "X_vvvv", "Y_v", "Y_vvv"]


def test_a_corner_plot_shows_each_parameter_and_pair_with_its_unit() -> None:
    made = estimate(parameters=3, trials=1, samples=40)
    axes = figures.corner(made).axes
    assert len(axes) == 6
    assert {panel.get_xlabel() for panel in axes} == {"", "R_0\n(N)", "X_vvvv", "Y_v"}
    assert len(figures.corner(estimate(parameters=9, trials=1, samples=40)).axes) == 15  # five at most
    steps = figures.chains(made, ["R_0"]).axes[0]
    assert (steps.get_xlabel(), steps.get_ylabel()) == ("step", "R_0 (N)")


def test_the_band_lies_around_what_is_fitted_and_around_zero_among_the_residuals() -> None:
    made = estimate(trials=1, samples=300)
    upper, lower = figures.traces(made, "zigzag_10_10", ["u"]).axes
    rows = made.traces[(made.traces["trial"] == "zigzag_10_10") & (made.traces["channel"] == "u")]
    shape = upper.collections[0].get_paths()[0].vertices[:, 1]
    assert shape.min() == pytest.approx(rows["band_lower"].min())
    assert shape.max() == pytest.approx(rows["band_upper"].max())
    np.testing.assert_allclose(np.abs(lower.collections[0].get_paths()[0].vertices[:, 1]), 0.01)
    made.traces = made.traces.drop(columns=["band_lower", "band_upper"])
    assert not figures.traces(made, "zigzag_10_10", ["u"]).axes[0].collections


def test_solvers_of_a_sweep_are_told_apart() -> None:
    """Their names begin alike and differ at the end, beyond what there is room for."""
    names = [f"differential_swarm, particles = {n}, omega = {w}" for n in (20, 50) for w in (0.7, 1.0)]
    shown = distinct([*names, "cma_es"])
    assert list(shown) == [*names, "cma_es"]
    assert len(set(shown.values())) == 5
    assert all(len(short) <= 28 for short in shown.values())
    assert shown["cma_es"] == "cma_es"
    assert shown[names[0]].endswith("20, omega = 0.7")
    inside = [f"{'a' * 30}{k}{'b' * 30}" for k in range(2)]
    assert distinct(inside) == dict(zip(inside, inside)), "no cut tells them apart"


def test_ranks_leave_room_for_long_names() -> None:
    names = [f"differential_swarm, particles = {n}" for n in (20, 50, 80)]
    table = pd.DataFrame({"solver": names, "mean_rank": [1.0, 2.0, 3.0]})
    figure = ranks(Ranking("fit", 20, "realisation", 1e-3, table, pd.DataFrame(), ()))
    drawn = FigureCanvasAgg(figure)
    drawn.draw()
    boxes = [text.get_window_extent(drawn.get_renderer()) for axes in figure.axes for text in axes.texts]
    assert len(boxes) == 6
    assert min(box.x0 for box in boxes) >= 0.0
    assert max(box.x1 for box in boxes) <= figure.bbox.x1

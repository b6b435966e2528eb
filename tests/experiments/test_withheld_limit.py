"""The limit: its evidence is the textbook's, its verdict names what is sure enough, a strong cause is found."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import multivariate_normal

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.cases import Plan, draw
from withheld.generate import sealed
from withheld.levels import holds, named, named_right, node_of
from withheld.programs.evidence import Menu, alone, evidence
from withheld.programs.limit import finest, limit
from withheld.programs.ways import ANY, STRONG, ways
from withheld.reality.families import families
from withheld.studies import log_text
from withheld.verdicts import problems


def test_evidence_is_the_marginal_likelihood_of_a_linear_model() -> None:
    rng = np.random.default_rng(2)
    columns, data = rng.normal(size=(30, 2)), rng.normal(size=30)
    stacked = np.column_stack([columns, data])
    sds = np.array([[0.3, 2.0], [1.0, 0.1]])
    found = evidence(stacked.T @ stacked, [0, 1], sds)
    for row, sd in enumerate(sds):
        covariance = np.eye(30) + columns @ np.diag(sd**2) @ columns.T
        wanted = multivariate_normal.logpdf(data, np.zeros(30), covariance)
        wanted -= multivariate_normal.logpdf(data, np.zeros(30), np.eye(30))
        assert found[row] == pytest.approx(wanted)


def test_the_finest_node_that_is_sure_enough_is_named() -> None:
    sure = finest("wind", [(["wind"], 0.9), ([], 0.1)])
    assert sure is not None
    assert (sure["cause"], sure["effects"]) == ("environment.force_fixed_to_earth.wind", ["wind"])
    group = finest("wind", [(["wind"], 0.5), (["wave_drift"], 0.4), (["tether"], 0.1)])
    assert group is not None
    assert (group["cause"], group["effects"]) == ("environment.force_fixed_to_earth", ["wind", "wave_drift"])
    assert group["probability"] == pytest.approx(0.9)
    assert finest("wind", [(["wind"], 0.5), (["heading_bias"], 0.5)]) is None


def test_a_form_on_one_drive_alone_has_the_node_of_its_effect() -> None:
    """The first weak drive of a sealed set ended the score, and a right name for it would have counted as wrong."""
    weak = "drive_gain_n_starboard"
    sure = finest(weak, [([weak], 0.9), ([], 0.1)])
    assert sure is not None
    assert (sure["cause"], sure["effects"]) == (node_of("drive_gain"), [weak])
    assert holds(sure, [weak])
    assert not holds(sure, ["drive_gain_n_port"])
    assert node_of("unknown") == ""


def test_ways_and_sizes_are_those_that_the_generator_draws() -> None:
    ship = families()["ship"]
    assert np.exp(ANY.logs).sum() == pytest.approx(1.0)
    assert np.exp(ANY.logs)[ANY.lambdas < 25].sum() == pytest.approx(0.25, abs=0.02)
    assert STRONG.lambdas[0] == pytest.approx(25.0)
    # Of a vector every direction is a sum of the quarters that were run, and keeps its length.
    found, variants = ways(ship.mechanism("current"))
    run = {label: present[0].values for label, present in variants}
    mixed = [sum(w * np.array([run[f"{a}@2"][k] for k in ("north", "east")]) for a, w in zip(way.labels, way.weights))
             for way in found]  # fmt: skip
    typical = ship.mechanism("current").draw(np.random.default_rng(1))
    assert np.linalg.norm(mixed, axis=1) == pytest.approx(np.hypot(typical["north"], typical["east"]))
    assert len({round(float(np.arctan2(v[1], v[0])), 6) for v in mixed}) == len(mixed)
    # What is drawn with either sign has two ways, what has one sign has one.
    assert [len(ways(ship.mechanism(key))[0]) for key in ("heading_bias", "drag")] == [2, 1]


def test_evidence_sums_over_sizes_and_signs() -> None:
    rng = np.random.default_rng(3)
    column, data = rng.normal(size=60), rng.normal(size=60)
    column *= 10.0 / np.linalg.norm(column)  # lambda 100 at its rung
    data += 0.8 * column
    stacked = np.stack([column, -column], axis=1)
    menu = Menu(stacked.T @ stacked, stacked.T @ data, [np.array([[0], [1]])], [np.log([0.5, 0.5])], [False])
    # A size is free where the largest believable one allows it: here up to lambda 100.
    f = np.sqrt(np.minimum(ANY.lambdas, 100.0)) / 10.0
    each = [np.exp(-0.5 * ((data - s * column) ** 2).sum() + 0.5 * (data**2).sum()) for s in (*f, *-f)]
    wanted = np.log(np.mean([np.dot(each[: len(f)], np.exp(ANY.logs)), np.dot(each[len(f) :], np.exp(ANY.logs))]))
    assert float(np.logaddexp.reduce(alone(menu, 0, ANY).ravel())) == pytest.approx(wanted)


@pytest.mark.slow
def test_a_strong_cause_is_named_and_a_strong_unknown_is_not(tmp_path: Path) -> None:
    auv = families()["auv"]
    for key, kind in (("depth_scale", "single"), ("one_sided_fouling", "outside")):
        case = draw(Plan("auv", kind, (key,), 3, 11))
        truth = sealed(case, "c001")
        for k, record in enumerate(case.records):
            (tmp_path / f"trial_{k + 1}.csv").write_text(log_text(auv, record))
        said = limit(truth, tmp_path)
        assert problems(said) == []
        assert sum(c["probability"] for c in said["candidates"]) == pytest.approx(1.0)
        if kind == "single":
            assert named_right(truth["effects"], said)
        else:
            assert (said["verdict"], named(said)) == ("unknown", [])

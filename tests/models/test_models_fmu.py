"""A ship as FMU, of both versions: read from its description, and the same ship as the equations of the MMG model."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pytest
from fmu_ships import PORTS, ship_fmu, zigzag

from seatruth import Study, load_model, simulator
from seatruth.costs import cost_of
from seatruth.errors import BadInput
from seatruth.models import FMU, Parameter, fmu_description, load_fmu
from seatruth.models.fmu_simulation import _grid
from seatruth.storage.cache_folder import CACHE
from seatruth.trials.trial import Trials

DRIVEN = ["delta", "n"]


@pytest.fixture(autouse=True)
def _nothing_from_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE, "off")


@pytest.mark.parametrize("fmi", [2, 3])
def test_it_is_the_ship_of_the_equations(fmi: Literal[2, 3]) -> None:
    model, equations = load_fmu(ship_fmu(fmi), ports=PORTS, kind="ship"), load_model("mmg")
    assert [c.name for c in model.inputs] == ["delta", "n"]
    assert [(c.name, c.unit, c.angle) for c in model.outputs] == [(c.name, c.unit, c.angle) for c in equations.outputs]
    assert [c.name for c in model.states] == [c.name for c in model.outputs]
    known = {q.name: (q.value, q.min, q.max, q.unit) for q in equations.parameters}
    assert {q.name: (q.value, q.min, q.max, q.unit) for q in model.parameters if q.name in known} == known
    ours, theirs = (simulator(m, [zigzag()], free=("R_0",), threads=1) for m in (equations, model))
    theta = np.array([[0.022], [0.03]])
    x0 = ours.initial_states[:, [3, 4, 5, 0, 1, 2]]
    assert theirs.initial_states == pytest.approx(x0)
    y, z = ours.outputs(theta, ours.initial_states).y, theirs.outputs(theta, x0).y
    # Inputs that are held over a step of 0.25 s stand for straight lines: errors of its square.
    assert (np.abs(y - z).max(axis=(0, 1)) < 2e-3 * np.ptp(y, axis=(0, 1)) + 1e-9).all()
    slopes = (s.jacobian(theta[0], x, ["u"]) for s, x in ((ours, ours.initial_states), (theirs, x0)))
    one, other = (found.dy for found in slopes)
    assert np.abs(one - other).max(axis=(0, 1)) == pytest.approx(0.0, abs=1e-2 * float(np.abs(one).max()))


def test_names_signs_units_and_prefixes() -> None:
    path = ship_fmu(prefix="hull.", edit=(('name="psi"', 'name="yaw [rad]"'),))
    model = load_fmu(
        path, names={"psi": "-yaw [rad]", "helm": "delta", "R": "hull.R_0"}, outputs=["psi", "u"], inputs=["helm", "n"]
    )
    assert [c.name for c in model.inputs] == ["helm", "n"]
    assert [c.unit for c in model.inputs] == ["rad", "rev/s"]
    assert {"hull_Y_v", "R"} <= {q.name for q in model.parameters}
    trial = zigzag()
    turned = trial.__class__("z", trial.t, {"helm": trial.inputs["delta"], "n": trial.inputs["n"]}, trial.outputs)
    whole = load_fmu(ship_fmu(), inputs=DRIVEN)
    first = {"psi": 0.3, "u": 0.8}
    found = model.run(turned, model.nominal(), first)
    others = {"x": 0.0, "y": 0.0, "v": 0.0, "r": 0.0, "psi": -0.3, "u": 0.8}
    expected = whole.run(trial, whole.nominal(), others)
    assert found[:, 0] == pytest.approx(-expected[:, 2])
    assert found[:, 1] == pytest.approx(expected[:, 3])


def test_a_port_takes_forces_in_its_own_unit() -> None:
    model = load_fmu(ship_fmu(), ports={"force": {"X": "-X"}}, inputs=DRIVEN)
    trial, first = zigzag(samples=6), {c.name: 0.0 for c in model.states}
    free = model.run(trial, model.nominal(), first)

    class Push:
        def __call__(self, t: float, outputs: Any) -> dict[str, float]:
            return {"X": 100.0}

        def describe(self) -> str:
            return "push"

    u = (model.run(trial, model.nominal(), first, Push()) - free)[:, 3]
    p = model.nominal()
    mass = p["rho"] * (p["nabla"] + 0.5 * p["L"] ** 2 * p["d"] * p["m_x"])  # of the ship and of added mass, kg
    assert u[1] == pytest.approx(-100.0 / mass, rel=0.01)  # the FMU's input is turned round, and is in kN


def test_outputs_that_cannot_be_set_start_where_the_simulator_wants() -> None:
    old = 'causality="output" variability="continuous" initial="exact"'
    path = ship_fmu(edit=((old, 'causality="output" variability="continuous"'),))
    model = load_fmu(path, inputs=DRIVEN, names={"surge": "u"}, initial={"surge": "u"})
    assert [channel.name for channel in model.states] == ["surge"]
    trial = zigzag(surge=np.full(60, 0.8))
    sim = simulator(model, [trial], threads=1)
    found = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0, 0]
    assert dict(zip((c.name for c in model.outputs), found.tolist())) == {
        **dict.fromkeys("xyvr", 0.0), "psi": 0.0, "surge": 0.8
    }  # fmt: skip
    bare = load_fmu(path, inputs=DRIVEN)
    assert bare.states == ()
    assert cost_of(Study("s", bare, Trials([zigzag()]), parameters=free(bare))).values(np.array([[0.02]])).shape == (1,)


def free(model: FMU) -> tuple[Parameter, ...]:
    return tuple(q.replace(vary=q.name == "R_0") for q in model.parameters)


def test_fixed_steps_and_samples_between_them() -> None:
    fixed = ship_fmu(edit=(('canHandleVariableCommunicationStepSize="true"', ""),))
    model, usual = load_fmu(fixed, inputs=DRIVEN), load_fmu(ship_fmu(), inputs=DRIVEN)
    whole = zigzag()
    between = whole.__class__("z", whole.t[:40] * 0.99, {k: v[:40] for k, v in whole.inputs.items()}, {})
    first = {**{c.name: 0.0 for c in model.states}, "u": 0.8}
    one, other = (m.run(between, m.nominal(), first) for m in (model, usual))
    assert (np.abs(one - other).max(axis=0) < 1e-2 * np.ptp(other, axis=0) + 1e-9).all()
    assert _grid(np.array([0.0, 1.0]), 0.4, False) == pytest.approx([0.0, 1 / 3, 2 / 3, 1.0])
    assert _grid(np.array([0.0, 1.0]), 0.4, True) == pytest.approx([0.0, 0.4, 0.8, 1.2])


@pytest.mark.parametrize(("trouble", "word"), [(1.0, "SIGABRT"), (2.0, "longer than"), (3.0, ""), (4.0, "")])
def test_what_a_foreign_simulator_does_wrong_costs_one_run(trouble: float, word: str) -> None:
    model = load_fmu(ship_fmu(), time_limit=2.0, inputs=DRIVEN)
    trial, first = zigzag(samples=12), {**{c.name: 0.0 for c in model.states}, "u": 0.8}
    bad = {**model.nominal(), "trouble": trouble, "trouble_above": 0.03, "R_0": 0.04}
    before = model.counts.failures.total()
    found = model.run(trial, bad, first)
    assert np.isnan(found[-1]).any()
    assert model.counts.failures.total() - before == bool(word)
    assert word in str(dict(model.counts.failures))
    assert np.isfinite(model.run(trial, {**bad, "R_0": 0.02}, first)).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"names": {"delta": "ruder"}}, r"no variable 'ruder'.*It has inputs: delta, n, X.*outputs: x, y, psi"),
        ({"names": {"1a": "delta"}}, "no usable name"),
        ({"names": {"a": "delta", "b": "delta"}}, "two names"),
        ({"names": {"n": "delta"}}, "both be called 'n'"),
        ({"names": {"R": "-R_0"}}, "turned round"),
        ({"outputs": ["speed"]}, "no output 'speed'"),
        ({"inputs": ["rudder"]}, "no input 'rudder'"),
        ({"initial": {"w": "u"}}, "'w' is no output"),
        ({"ports": {"force": {"X": "R_0"}}}, "no input that takes numbers"),
        ({"ports": {"force": {"X": "delta"}}}, "is"),
        ({"ports": {"wind": ["X"]}}, "no port 'wind'"),
        ({"step": 0.0}, "step"),
    ],
)
def test_what_cannot_be_mapped_names_what_there_is(options: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        load_fmu(ship_fmu(), **options)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ((('fmiVersion="2.0"', 'fmiVersion="1.0"'),), "FMI 1.0"),
        ((("<CoSimulation", "<ModelExchange"),), "model exchange alone"),
        ((("<ModelVariables>", "<ModelVariables"),), "cannot be read"),
        ((('modelIdentifier="ship"', 'modelIdentifier="boat"'),), "no library for this machine.*it has"),
        ((('unit="m/s"', 'unit="furlong/fn"'),), "furlong/fn"),
        ((('unit="rad"', 'unit="kg/m^3"'),), "kg/m"),
    ],
)
def test_an_fmu_that_cannot_be_simulated_says_why(edit: tuple[tuple[str, str], ...], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        load_fmu(ship_fmu(edit=edit))


def test_files_that_are_no_fmu(tmp_path: Path) -> None:
    shutil.copy(ship_fmu(), tmp_path / "ship.fmu")
    with pytest.raises(BadInput, match=r"no such FMU.*ship\.fmu"):
        load_fmu(tmp_path / "shp.fmu")
    (tmp_path / "text.fmu").write_text("no")
    with pytest.raises(BadInput, match="not a ZIP"):
        load_fmu(tmp_path / "text.fmu")
    with zipfile.ZipFile(tmp_path / "empty.fmu", "w") as archive:
        archive.writestr("other.txt", "no")
    with pytest.raises(BadInput, match="cannot be read"):
        load_fmu(tmp_path / "empty.fmu")
    assert isinstance(load_model("ship.fmu", tmp_path), FMU)
    with pytest.raises(BadInput, match="no parameter sets"):
        load_model("ship.fmu", tmp_path, "KVLCC2")


HEAD = '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">'


def archive(path: Path, text: str, more: dict[str, bytes] | None = None) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("modelDescription.xml", text)
        for name, content in (more or {}).items():
            made.writestr(name, content)
    return path


def test_an_fmu_that_grows_without_bound_or_reads_elsewhere_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "hostile.fmu"
    secret = tmp_path / "secret.txt"
    secret.write_text("the secret")
    entity = f'<!DOCTYPE m [<!ENTITY x SYSTEM "{secret.as_uri()}">]>{HEAD}&x;</fmiModelDescription>'
    with pytest.raises(BadInput, match="declares a document type"):
        load_fmu(archive(file, entity))
    with pytest.raises(BadInput, match=r"more than 67 MB"):
        load_fmu(archive(file, HEAD + " " * 2**26))
    monkeypatch.setattr(fmu_description, "_LARGEST", 10**6)
    with pytest.raises(BadInput, match=r"would unpack to 0\.002 GB in 2 files"):
        load_fmu(archive(file, HEAD, {"resources/zeros": bytes(2 * 10**6)}))
    monkeypatch.setattr(fmu_description, "_MOST_FILES", 3)
    with pytest.raises(BadInput, match="in 5 files"):
        load_fmu(archive(file, HEAD, {f"resources/{k}": b"" for k in range(4)}))


def test_a_damaged_archive_is_refused(tmp_path: Path) -> None:
    """Its decoder raises what is no error of archives."""
    content = bytearray(archive(tmp_path / "damaged.fmu", HEAD + "abcdefgh" * 1000).read_bytes())
    for place in range(60, 75):
        content[place] ^= 0xFF
    (tmp_path / "damaged.fmu").write_bytes(content)
    with pytest.raises(BadInput, match="cannot be read"):
        load_fmu(tmp_path / "damaged.fmu")


def test_what_does_not_fit_on_the_disk_is_not_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=100))
    with pytest.raises(BadInput, match=r"unpacks to .* GB left"):
        load_fmu(ship_fmu(prefix="no_room_"))


@pytest.mark.parametrize("factor", ["nan", "inf", "0", "1e400"])
def test_a_unit_that_turns_numbers_into_none_is_unknown(factor: str) -> None:
    edit = (('unit="kN"', 'unit="pull"'), ('name="kN"', 'name="pull"'), ('factor="1000"', f'factor="{factor}"'))
    with pytest.raises(BadInput, match="pull"):
        load_fmu(ship_fmu(edit=edit))


def test_an_older_file_is_another_simulator() -> None:
    hashes = {
        Study("s", load_fmu(path, inputs=DRIVEN), Trials([zigzag()])).content_hash
        for path in (ship_fmu(2), ship_fmu(3), ship_fmu(2))
    }
    assert len(hashes) == 2

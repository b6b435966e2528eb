"""What a study must have to be diagnosed, which effects can act on it, and what weakens any answer."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.options import FormulaOptions
from seatruth.diagnosis.other_faults import untried
from seatruth.diagnosis.problem import Problem
from seatruth.effects import Effect, available, available_on, effects_by_name
from seatruth.effects.carried_black_box import not_carried
from seatruth.effects.causes import is_within
from seatruth.effects.dependence import depends_on
from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.study import Study
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial
from seatruth.uncertainty.prior_identifiability import KEEP_FROM_ZERO
from seatruth.uncertainty.reversed_inputs import reversed_inputs

_FEWEST_SAMPLES = 10
"""Samples of a trial below which nothing can be said of its motion. [S]"""
_LARGEST = 1e100
"""Size of a value, in SI units, from which its square and sums of such squares leave double precision."""
_GROWN = 1e12
"""Size of derivatives, in SI units, from which a run is about to diverge. [S] Those of usual runs are below 1e6."""
_ONE_COURSE = 0.5
"""rad: courses that differ less count as one. [S]"""
_THRUST = "actuator.propulsion"
"""Family of causes that act on what a thruster gives: nothing, where it stands still. A rudder amidships has a zero."""

_NEAR_VERTICAL = math.radians(80.0)
"""Pitch beyond which rates of the Euler angles are more than six times those of the body, 1/cos(pitch). [S]"""


def require_trials(study: Study) -> None:
    """Raises BadInput for a study that cannot be diagnosed."""
    where = f"study {study.name!r}"
    if isinstance(study.cost, FormulaOptions):
        raise BadInput("a formula has no motion to diagnose", where=where, do="Give it a model and trials in time.")
    short = [trial.name for trial in study.trials if len(trial) < _FEWEST_SAMPLES]
    if short:
        raise BadInput(f"trial {short[0]!r} has fewer than {_FEWEST_SAMPLES} samples", where=where, do="Leave it out.")
    for trial in study.trials:
        for name, values in (*trial.inputs.items(), *trial.outputs.items()):
            wild = np.flatnonzero(np.isfinite(values) & (np.abs(values) > _LARGEST))
            if wild.size:
                raise BadInput(
                    f"the value {values[wild[0]]:.3g} is none that a vehicle has",
                    where=f"trial {trial.name!r}, channel {name!r}, t = {trial.t[wild[0]]:g} s",
                    do="Correct it, or leave the sample empty.",
                )


def turned_round(study: Study, threads: int | None) -> list[Finding]:
    """An error for each input that makes the model turn the other way than the record, and turned round as recorded.

    Its refit would end at a bound, and what is missing beside it would be its own mirror image.
    """
    found = reversed_inputs(study, threads=threads)
    return [replace(f, severity="error", where=f"channel {f.channel!r}" if f.channel else f.where) for f in found]


def usable_effects(study: Study, wanted: Sequence[Effect | str] | None) -> tuple[list[Effect], dict[str, str]]:
    """Effects that can act on the study's model, and why others cannot. BadInput where none can."""
    asked = list(available().values())
    if wanted is not None:
        installed = available_on(study.model)
        asked = [e if isinstance(e, Effect) else effects_by_name([e], installed)[0] for e in wanted]
    names = [trial.name for trial in study.trials]
    tried = [e.candidates(study.model) or (e.variants(study.model) if wanted is not None else ()) for e in asked]
    forms = {form.name: form.of_trials(names) for found in tried for form in found}
    speed = usual_speed(study.model, study.trials)
    if speed > 0.0:
        forms = {name: form.at_speed(speed) for name, form in forms.items()}
    asked = list(forms.values())
    present = {effect.name for effect in getattr(study.model, "effects", ())}
    usable, reasons = [], {}
    for effect in asked:
        reason = "the model has it already" if effect.name in present else effect.missing(study.model)
        if not reason and not effect.dynamic:
            reason = "it is noise, which the noise model describes"
        if not reason and effect.start and not depends_on(study.model, effect.start):
            reason = f"no rate depends on {effect.start!r}, so that it is part of that at the start of a trial"
        reason = reason or _unseen(effect, study)
        if reason:
            reasons[effect.name] = reason
        else:
            usable.append(effect)
    if not usable:
        raise BadInput(
            "no effect can act on this model",
            where=f"study {study.name!r}",
            do="; ".join(f"{name}: {why}" for name, why in list(reasons.items())[:3]),
        )
    return usable, reasons


def _unseen(effect: Effect, study: Study) -> str:
    """Why no trial of a study can show an effect: its sensors are not recorded, or its thrusters stand still."""
    places = [place.partition(":") for place in effect.places(study.model)]
    if places and all(word == "sensor" for word, _, _ in places):
        recorded = {n for trial in study.trials for n, values in trial.outputs.items() if np.isfinite(values).any()}
        if not recorded & {channel for _, _, channel in places}:
            return f"no trial records {places[0][2]!r}"
    if places and all(word == "actuator" for word, _, _ in places) and is_within(effect.cause, _THRUST):
        moved = {n for trial in study.trials for n, values in trial.inputs.items() if np.any(values)}
        if not moved & {channel for _, _, channel in places}:
            return f"no trial moves {places[0][2]!r}"
    return ""


def usual_speed(model: Model, trials: Sequence[Trial]) -> float:
    """Median size of the recorded speed ahead, m/s, or of that between positions; 0 where neither is recorded."""
    shown = {model.standard_of(channel.name)[0]: channel.name for channel in model.outputs}
    ahead, ways = list[Array](), list[Array]()
    for trial in trials:
        if "u" in shown and shown["u"] in trial.outputs:
            ahead.append(np.abs(trial.outputs[shown["u"]]))
        elif {"x", "y"} <= {*shown} and {shown["x"], shown["y"]} <= {*trial.outputs}:
            x, y = trial.outputs[shown["x"]], trial.outputs[shown["y"]]
            rows = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
            ways.append(np.hypot(np.diff(x[rows]), np.diff(y[rows])) / np.diff(trial.t[rows]))
    speeds = np.concatenate([*ahead, *ways, np.zeros(0)])
    speeds = speeds[np.isfinite(speeds)]
    return float(np.median(speeds)) if speeds.size else 0.0


def unseen(study: Study, reasons: Mapping[str, str]) -> list[Finding]:
    """What a diagnosis of a black box cannot see for want of ports, in one finding."""
    if not isinstance(study.model, BlackBox):
        return []
    ports, lacking = study.model.innermost.ports, []
    inside = [name for name, why in reasons.items() if "without a port" in why or "no port for a current" in why]
    if not ports.force:
        lacking.append("forces, so that no missing force can be looked for")
    if not ports.current and not_carried(study.model):
        lacking.append("a current")
    if not lacking:
        return []
    tried = f" Not tried: {', '.join(inside)}." if inside else ""
    text = f"The simulator has no port for {' nor for '.join(lacking)}.{tried}"
    do = "Name the inputs that take them (docs/simulators.md): ports = { force = [...], current = [...] }."
    return [Finding("warning", "no-ports", text, f"model {study.model.name!r}", do)]


def untried_forms(study: Study, tried: Mapping[str, Effect], named: Iterable[str]) -> list[Finding]:
    """Faults of single actuators that look like a named one, and that a diagnosis does not try by itself."""
    found = []
    for name in named:
        usable = untried(study, tried, name)
        if usable:
            one = " and ".join(tried[name].which)
            text = f"Other faults of {one} alone may look like {tried[name].title}, and were not tried: " + ", ".join(
                form.title.split(":")[0] for form in usable
            )
            do = f"Compare them: --effects {','.join([name, *(form.name for form in usable)])}"
            found.append(Finding("note", "untried-forms", f"{text}.", f"actuator {one}", f"{do}."))
    return found


def weaknesses(study: Study, problem: Problem) -> list[Finding]:
    """What weakens any diagnosis of this study."""
    found = []
    where = f"study {study.name!r}"
    if len(study.trials) == 1:
        text = "There is one trial: effects are checked on parts of it, and nothing is predicted from other trials."
        found.append(Finding("warning", "one-trial", text, where, "Add trials."))
    if not len(problem.coefficients):
        text = "No coefficient of the model is free: any error in one would be taken for an effect."
        found.append(Finding("warning", "no-coefficients", text, where, "Set `vary` for those that are uncertain."))
    without = [p.name for p in study.parameters if p.vary and p.prior is None]
    if without:
        percent = 100.0 * problem.settings.coefficient_sd
        text = f"{len(without)} free coefficients state no prior; {percent:.0f} % of the value was taken."
        do = (
            f"State what is known of them in [parameters]: {without[0]}.prior = {{ mean = ..., sd = ... }}. What is "
            "known better takes less of the gap, what is known worse more."
        )
        found.append(Finding("note", "prior-assumed", text, where, do))
    trials = list(problem.trials)
    for k, one in enumerate(trials):
        for other in trials[k + 1 :]:
            if _same(one, other):
                text = f"Trials {one.name!r} and {other.name!r} hold the same data: they count twice."
                found.append(Finding("error", "duplicate", text, where, "Leave one out.", one.name))
    steep = [trial.name for trial in trials if _pitches_near_vertical(trial)]
    if steep:
        degrees = math.degrees(_NEAR_VERTICAL)
        text = (
            f"In {' and '.join(repr(name) for name in steep)} the vehicle pitches by more than {degrees:.0f} deg, where"
            " roll and heading turn by any amount in a moment. A simulation may follow the record from there by chance,"
            " and what is fitted to it may be wrong by more than its interval says."
        )
        found.append(Finding("warning", "near-vertical", text, where, "Cut the trial before it.", steep[0]))
    found.extend(_without_derivatives(problem))
    if on_one_course(trials):
        text = "All trials keep to one course: a current, a heading bias and a wind look alike there."
        found.append(Finding("warning", "one-course", text, where, "Add a reciprocal run or a full turn."))
    return found


def _without_derivatives(problem: Problem) -> list[Finding]:
    """A finding on where the model's runs have no derivatives, though they do not diverge; none of a black box."""
    if problem.few_runs is not None:
        return []
    names = [problem.unknowns[k].name for k in problem.coefficients]
    at, values = problem.start, problem.named(problem.start)
    simulator, theta = problem.bound(at, names), np.array([values[name] for name in names])
    simulated = simulator.jacobian(theta, problem.start_states(at), problem.initial_names, last_states=False)
    runs = np.abs(simulated.y[:, :, None]), np.abs(simulated.dy)
    for trial, rows in zip(problem.trials, simulator.rows, strict=True):
        whole, slopes = (part[rows].max(axis=(1, 2), initial=0.0) for part in runs)
        lost = np.flatnonzero(~np.isfinite(slopes) & np.isfinite(whole))
        # Runs about to diverge lose theirs to overflow: they grow before that.
        if lost.size and (slopes[: lost[0]] < _GROWN).all():
            text = (
                f"At t = {trial.t[lost[0]]:g} s of {trial.name!r} the model's run has no derivatives: a power of zero,"
                " or a division by it. What needs them from there on counts as without any influence."
            )
            where = f"trial {trial.name!r}"
            return [Finding("warning", "no-derivatives", text, where, KEEP_FROM_ZERO, trial.name)]
    return []


def _pitches_near_vertical(trial: Trial) -> bool:
    pitch = np.abs(np.asarray(trial.outputs.get("theta", ())))
    return bool((pitch[np.isfinite(pitch)] > _NEAR_VERTICAL).any())


def on_one_course(trials: Sequence[Trial]) -> bool:
    """Whether all trials keep to one course, and none turns by half a circle."""
    courses = []
    for trial in trials:
        psi = np.asarray(trial.outputs.get("psi", np.zeros(0)))
        psi = psi[np.isfinite(psi)]
        if not psi.size:
            continue
        if float(np.ptp(psi)) > math.pi:
            return False
        courses.append(float(np.angle(np.mean(np.exp(1j * psi)))))
    return bool(courses) and all(abs(np.angle(np.exp(1j * (c - courses[0])))) < _ONE_COURSE for c in courses)


def _same(one: Trial, other: Trial) -> bool:
    return len(one) == len(other) and all(
        name in other.outputs and np.array_equal(values, other.outputs[name], equal_nan=True)
        for name, values in one.outputs.items()
    )

"""From a parsed study file to a Study: the model, its parameters, the trials and how they are compared."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seatruth.costs.options import OPTIONS, CostOptions, FormulaOptions, Kind, option_names
from seatruth.effects import load_effects, with_effects
from seatruth.models.parameter import Parameter
from seatruth.progress import Progress, silent
from seatruth.study import expressions, formula, noise, observations, parameters, simulators, trial_files
from seatruth.study.actuators import with_actuators
from seatruth.study.holds import with_holds
from seatruth.study.schema import StudyFile
from seatruth.study.study import Study
from seatruth.study.validation import Problems


def study(file: StudyFile, source: Path, name: str, problems: Problems, progress: Progress = silent) -> Study | None:
    """The study; None where something is wrong with it (`problems` says what). `progress` hears of the reading."""
    _check_kind(file, problems)
    if file.formula is not None:
        return _of_formula(file, source, name, problems, progress) if file.model is None else None
    if file.model is None:
        return None
    model = None
    with problems.at("model", "use"):
        model = simulators.model_of(file.model, file.cost.hold, source.parent, problems)
    if model is not None:
        model = observations.observed_as_stated(model, file, problems)
    if model is not None:
        model = with_holds(model, file, problems)
    if model is not None:
        model = with_actuators(model, file.actuators, problems)
    recordings = trial_files.recordings(file, source.parent, problems)
    if model is not None and file.model.effects:
        plain, model = model, None
        fitted = [recording.name for recording in recordings if recording.table.role == "fit"]
        with problems.at("model", "effects"):
            effects = load_effects(file.model.effects, source.parent, plain)
            model = with_effects(plain, [effect.of_trials(fitted) for effect in effects])
    if model is not None:
        observations.check_initial_state(model, file, problems)
    if model is None:
        return None
    declared = parameters.merged(model.parameters, file.model, file.parameters, problems)
    expressions.check(declared, file.model.constraints, problems)
    if not any(parameter.vary for parameter in declared):
        problems.add(
            ("model", "vary"),
            "no parameter varies",
            "Name those to identify: vary = [...] in [model], or vary = true in [parameters.NAME].",
        )
    pair = observations.speed_and_course(model, file)
    of_inputs = {
        c.name: "It is an input, which is taken as recorded: [noise] is that of outputs." for c in model.inputs
    }
    hints = {**of_inputs, **observations.without_velocity(model, file)}
    sd = noise.deviations(file.noise, (*model.outputs, *pair[:1]), ("noise",), problems, hints=hints)
    initial = noise.deviations(file.cost.initial_sd, model.states, ("cost", "initial_sd"), problems, estimate=False)
    trials, holdout = trial_files.read(
        file, model, recordings, problems, synthetic=file.study.synthetic, progress=progress
    )
    if problems:
        return None
    options: CostOptions | None = None
    with problems.at("cost"):
        options = _options(file, initial)
    if options is None:
        return None
    with problems.at("study"):
        return Study(
            name=name,
            model=model,
            trials=trials,
            holdout=holdout,
            parameters=declared,
            constraints=tuple(file.model.constraints),
            cost=options,
            noise=observations.noise_of_velocity(sd, pair),
            provenance=_provenance(file, source, recordings),
        )
    return None


def _of_formula(file: StudyFile, source: Path, name: str, problems: Problems, progress: Progress) -> Study | None:
    """The study of a static formula."""
    made = formula.parts(file, source.parent, problems)
    if made is None:
        return None
    expressions.check(made.parameters, (), problems)
    if not any(parameter.vary for parameter in made.parameters):
        problems.add(("parameters",), "no parameter varies", "Set vary = true for those to identify.")
    sd = noise.deviations(file.noise, made.model.outputs, ("noise",), problems)
    trials = formula.read(file, made, problems, progress)
    if problems:
        return None
    with problems.at("study"):
        return Study(
            name=name,
            model=made.model,
            trials=trials,
            parameters=made.parameters,
            cost=FormulaOptions(),
            noise=sd,
            provenance=_provenance(file, source, [made.table]),
        )
    return None


def profiled(
    patterns: Sequence[str], declared: Sequence[Parameter], path: tuple[str, ...], problems: Problems
) -> tuple[str, ...]:
    """The free parameters that the patterns take."""
    free = [parameter.name for parameter in declared if parameter.vary]
    return tuple(parameters.expand(patterns, free, path, "free parameter", problems)) if declared else ()


def _check_kind(file: StudyFile, problems: Problems) -> None:
    """One model or one formula, and only options of the cost that is used."""
    if file.model is not None and file.formula is not None:
        problems.add(("formula",), "the study has both a model and a formula", "Remove [model] or [formula].")
    elif file.formula is not None:
        if "kind" in file.cost.model_fields_set and file.cost.kind != "formula":
            problems.add(("cost", "kind"), f"a formula has no {file.cost.kind} cost", 'Set kind = "formula".')
    elif file.cost.kind == "formula":
        problems.add(("cost", "kind"), "a formula cost needs a formula", "Add [formula] with its expression.")
    elif file.model is None:
        problems.add((), "the study names no model", 'Add [model] with use = "...", see `seatruth list models`.')
    used: Kind = "formula" if file.formula is not None else file.cost.kind
    for key in sorted(file.cost.model_fields_set - {"kind", *option_names(OPTIONS[used])}):
        owners = [kind for kind, options in OPTIONS.items() if key in option_names(options)]
        problems.add(("cost", key), f"{key!r} is no option of a {used} cost", f"It belongs to: {', '.join(owners)}.")


def _options(file: StudyFile, initial_sd: Mapping[str, Any]) -> CostOptions:
    """The options of the file's cost; those that it does not state keep their defaults."""
    kind = OPTIONS[file.cost.kind]
    stated = {key: getattr(file.cost, key) for key in file.cost.model_fields_set - {"kind"}}
    if "initial_sd" in stated:
        stated["initial_sd"] = dict(initial_sd)
    return kind(**{key: value for key, value in stated.items() if key in option_names(kind)})


def _provenance(file: StudyFile, source: Path, recordings: Sequence[trial_files.Recording]) -> dict[str, Any]:
    """Which files the study came from, by the hash of their bytes; names without the folders of this machine."""
    hashes = {recording.path.name: _sha256(recording.path) for recording in recordings}
    return {"study_file": source.name, "study_sha256": _sha256(source), "file_sha256": hashes}


def _sha256(path: Path) -> str:
    """Hash of a file; of a folder (a ROS 2 bag) the hash of its files' hashes, in the order of their names."""
    if path.is_dir():
        parts = [part for part in sorted(path.rglob("*")) if part.is_file()]
        return hashlib.sha256("".join(_sha256(part) for part in parts).encode()).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()

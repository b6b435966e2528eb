"""The schema of the study file as pydantic models.

Every table and key of a study file is a field here with its description; docs/study-file.md is generated from them. The
models check types and spelling only. Checks that need the model, the trials or the plug-ins (whether a parameter or a
file exists) run where the study is built.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, PositiveFloat, PositiveInt

from seatruth.statistics.posterior_sample import MOST_STEPS, STEPS
from seatruth.study.schema_base import OpenTable, Pair, Table, as_list, as_table
from seatruth.study.schema_trials import (
    ActuatorTable,
    Channels,
    FilesTable,
    FramesTable,
    PrepareTable,
    TimeTable,
    TrialTable,
)


class StudyTable(Table):
    """Name, description and seed of the study."""

    name: str | None = Field(
        default=None, description="Name of the study in results and reports; default: the file's name."
    )
    description: str = Field(default="", description="What the study is for; shown in the report.")
    seed: Annotated[int, Field(ge=0)] = Field(
        default=0, description="Seed of all random numbers. The same seed gives the same result."
    )
    synthetic: bool = Field(
        default=False, description="True if a simulator made the trials; every result and report then says so."
    )


class PortsTable(Table):
    """Where a simulator takes outside forces and a current: components, `["X", "Y", "N"]`, or each component with the
    FMU's variable, `{ X = "F_surge", Y = "-F_port" }`."""

    force: list[str] | dict[str, str] = Field(
        default=[],
        description="Some of X, Y, Z (forces) and K, M, N (moments) in body axes: forward, to starboard, down.",
    )
    current: list[str] | dict[str, str] = Field(
        default=[],
        description="north, east, down: where the water moves to; or u_c, v_c, w_c, the same in body axes.",
    )


class DimensionsTable(Table):
    """The size of the vehicle behind a simulator."""

    length: Annotated[FiniteFloat, Field(gt=0)] = Field(description="Length, m.")
    breadth: Annotated[FiniteFloat, Field(gt=0)] = Field(description="Breadth, m.")
    draft: Annotated[FiniteFloat, Field(gt=0)] = Field(description="Draft, or height under water, m.")
    mass: Annotated[FiniteFloat, Field(gt=0)] = Field(description="Mass of the vehicle itself, kg.")
    rho: Annotated[FiniteFloat, Field(gt=0)] = Field(default=1025.0, description="Density of the water, kg/m3.")
    frontal_area: Annotated[FiniteFloat, Field(gt=0)] | None = Field(
        default=None, description="Area above water seen from ahead, m2; default: estimated by the effect."
    )
    lateral_area: Annotated[FiniteFloat, Field(gt=0)] | None = Field(
        default=None, description="Area above water seen from the side, m2; default: estimated by the effect."
    )


class ModelActuatorTable(Table):
    """An actuator of the vehicle in an FMU, so that effects find its input: a thruster where `at` is stated, else a
    rudder or a plane. What a log holds of it stands in [actuators.NAME]."""

    input: str = Field(description="The input that drives or steers it, by its name in `names` or in the FMU.")
    turns: Literal["yaw", "pitch"] | None = Field(
        default=None, description="yaw for what works as a rudder (default), pitch for a stern or bow plane."
    )
    full: Annotated[FiniteFloat, Field(gt=0)] | None = Field(
        default=None,
        description="Of a thruster: size of its input at full power, in SI units (revolutions in rev/s). Beside "
        "`turns`: what an input that is no angle holds hard over, which effects count as 35 deg.",
    )
    at: Annotated[list[float | str], Field(min_length=3, max_length=3)] | None = Field(
        default=None,
        description="Of a thruster: its place [x, y, z], m forward, starboard and down of the model's origin; a text "
        'names a parameter of the FMU, as "-y_T".',
    )
    towards: Annotated[list[float | str], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="Of a thruster: the direction of a positive thrust, a unit vector in these axes."
    )
    diameter: Annotated[FiniteFloat, Field(gt=0)] | None = Field(
        default=None, description="Of a thruster: diameter of the propeller or the jet, m."
    )
    force: str | None = Field(
        default=None,
        description="Of a thruster: the output of the FMU that is its force, N, positive along `towards`, by its name "
        "in `names` or in the FMU. Either all thrusters have it or none.",
    )
    turned_by: str | None = Field(
        default=None,
        description="Of a thruster in a pod: the input (rad) that turns it from `towards`, clockwise seen from above; "
        '"-azimuth" where it counts the other way.',
    )


class ModelTable(Table):
    """The vehicle's model."""

    use: str = Field(
        description='A model of `seatruth list models`, your own model as "file.py:ClassName", or a simulator as '
        '"file.fmu" (paths relative to the study file). A study runs no code but such files of models and effects.'
    )
    set: str | None = Field(
        default=None, description='Parameter set of the model, as "KVLCC2"; default: the values in the model.'
    )
    effects: list[str] = Field(
        default=[],
        description='Effects of `seatruth list effects`, or your own as "file.py:ClassName". They are added to the '
        'model at their null. Parameters have names such as "current_north" and can be identified like any other.',
    )
    vary: list[str] = Field(
        default=[],
        description="Parameters to identify, by name or pattern (`*` and `?`); the same as `vary = true` in each of "
        "their tables.",
    )
    constraints: list[str] = Field(
        default=[], description='Relations between parameters that every estimate must satisfy, as "Y_v * N_r > 0".'
    )
    names: dict[str, str] = Field(
        default={},
        description='Own names for variables of an FMU, `{ delta = "rudder.angle", psi = "-yaw" }`; a minus turns the '
        "sign. Default: the FMU's names.",
    )
    inputs: list[str] | None = Field(
        default=None,
        description="Inputs of an FMU that the trials give; the others stay at their start values. Default: all.",
    )
    outputs: list[str] | None = Field(default=None, description="Outputs of an FMU that take part; default: all.")
    initial: dict[str, str] = Field(
        default={},
        description='Variables of an FMU that set the initial value of an output, `{ u = "u_start" }`. Outputs that '
        "can be set themselves need none.",
    )
    ports: PortsTable = Field(
        default=PortsTable(), description="Inputs of an FMU that take outside forces and a current; see [model.ports]."
    )
    dimensions: DimensionsTable | None = Field(
        default=None, description="Size of the vehicle in an FMU, which effects of wind, waves and hull need."
    )
    frontal_area: PositiveFloat | str | None = Field(
        default=None,
        description='Area above water seen from ahead, as "12 m2", where it is known; any model that has a size takes '
        "it. Default: what the model says, or the wind's estimate.",
    )
    lateral_area: PositiveFloat | str | None = Field(
        default=None, description="Area above water seen from the side, alike."
    )
    actuators: dict[str, ModelActuatorTable] = Field(
        default={},
        description="What drives and steers the vehicle in an FMU, which effects on rudders and thrusters need; see "
        "[model.actuators.NAME]. Default: an input `delta` is a rudder, `delta_s` a plane, and there are no thrusters.",
    )
    kind: Literal["", "ship", "auv", "glider", "planing"] = Field(
        default="", description="Kind of vehicle in an FMU: which effects can act on it. Default: any."
    )
    step: PositiveFloat | None = Field(
        default=None, description="Longest communication step of an FMU, s; default: its own, or one a sample."
    )
    time_limit: PositiveFloat | None = Field(
        default=None,
        description="Seconds that an FMU, or a black box from a file, may take for one trial; then the run counts as "
        "diverged. A black box from a file then runs in processes of its own, as an FMU always does. Default: 60, "
        "for an FMU.",
    )


class PriorTable(Table):
    """A normal prior N(mean, sd) on a parameter. Without one, `diagnose` believes a free one to 20 % of its value, far
    too little for one that is small by chance, as a cross term.
    """

    mean: FiniteFloat = Field(description="Mean, in the parameter's unit.")
    sd: Annotated[FiniteFloat, Field(gt=0)] = Field(description="Standard deviation, in the parameter's unit.")


class ParameterTable(Table):
    """One parameter, in the unit of the model. A bare number is short for `{ value = number }`."""

    value: FiniteFloat | None = Field(
        default=None, description="Value, from which the search starts; default: the prior's mean, else the model's."
    )
    min: float | None = Field(default=None, description="Lower bound.")
    max: float | None = Field(default=None, description="Upper bound.")
    vary: bool | None = Field(
        default=None,
        description="True: the parameter is identified. Default: fixed, unless `vary` of [model] names it.",
    )
    prior: PriorTable | None = Field(default=None, description="Prior knowledge, `{ mean = 0.3, sd = 0.05 }`.")
    scale: Literal["linear", "log"] | None = Field(
        default=None, description="The search varies the value or its logarithm."
    )
    start: Pair | None = Field(default=None, description="Region [low, high] of random starts; default: the bounds.")
    expr: str | None = Field(
        default=None, description='Expression that sets the parameter from others, as "-0.5 * Y_v".'
    )
    unit: str | None = Field(default=None, description="Unit, in formula studies only; a model declares its units.")


class CostTable(Table):
    """How a candidate is compared with the trials. Each kind has its own options."""

    kind: Literal["trajectory", "regression", "formula"] = Field(
        default="trajectory",
        description="trajectory: simulate the whole run, compare with the record. regression: fit accelerations "
        "equation by equation. formula: fit a static formula to a table.",
    )
    hold: Literal["foh", "zoh"] = Field(
        default="foh",
        description="Inputs between samples: foh (first-order hold: straight lines) or zoh (zero-order hold: constant "
        "until the next sample).",
    )
    max_step: PositiveFloat | None = Field(
        default=None, description="Longest integration step, s; default: the sampling step."
    )
    initial: Literal["fixed", "free"] = Field(
        default="fixed",
        description="Initial state of each trial: taken from its first samples, or estimated. An actuator behind a "
        "servo begins at its first order, unless initial_sd has a value for it (delta_acting). A speed that no "
        "channel has is that of the first positions.",
    )
    initial_sd: dict[str, float | str] = Field(
        default={},
        description='Standard deviation of the first samples, by state, as { u = "0.05 m/s" }; with initial = "free".',
    )
    segments: PositiveFloat | None = Field(
        default=None,
        description="Length, s, of segments into which the trials are cut; each starts from its first samples.",
    )
    multiple_shooting: bool = Field(
        default=False, description="True: the initial states of the segments are free, and the segments must join."
    )
    criterion: Literal["weighted", "likelihood"] = Field(
        default="weighted",
        description="weighted: least squares with the noise of [noise]. likelihood: maximum likelihood with an "
        "estimated measurement-noise covariance R.",
    )
    form: Literal["euler", "central", "trapezoid"] = Field(
        default="trapezoid", description="Formula by which a regression differentiates the states."
    )
    equations: list[str] | None = Field(
        default=None, description="States whose equations a regression uses; default: all that contain free parameters."
    )


class OptimizerTable(OpenTable):
    """A solver; the further keys are its options (`seatruth list optimizers --long`). Two or more [[optimizer]]
    tables make a hybrid: each solver starts where the one before ended."""

    use: str = Field(default="least_squares", description="A solver of `seatruth list optimizers`.")
    share: Annotated[FiniteFloat, Field(gt=0, lt=1)] | None = Field(
        default=None, description="Part of the budget that this stage of a hybrid may use (all but the last stage)."
    )
    starts: PositiveInt | None = Field(
        default=None,
        description="Search from this many starts, each with the whole budget, and compare the optima: the start "
        "values, then points spread over each parameter's `start`, bounds or prior. In a hybrid, in its first table.",
    )


class BudgetTable(Table):
    """Limits at which a search stops."""

    evaluations: PositiveInt | None = Field(
        default=None, description="Simulations of all trials, finite differences counted."
    )
    diagnosis: PositiveInt | None = Field(
        default=None,
        description="Simulations of all trials that the diagnosis of a black box may take; default: no limit.",
    )
    seconds: PositiveFloat | None = Field(default=None, description="Wall time.")
    stall: PositiveInt | None = Field(default=None, description="Stop after this many evaluations without progress.")
    tolerance: Annotated[FiniteFloat, Field(ge=0)] = Field(
        default=1e-9, description="Relative decrease of the cost that counts as progress."
    )
    target: FiniteFloat | None = Field(default=None, description="Stop as soon as the cost is this low.")


class OutputTable(Table):
    """Files that are written, and results that are computed in addition to the fit."""

    folder: str | None = Field(
        default=None, description="Folder of the result, in the folder of the study file; default: NAME-result there."
    )
    report: bool = Field(default=True, description="Write report.html.")
    cross_validate: bool = Field(
        default=False, description="Leave out each trial in turn, fit the others and predict it."
    )
    profile: list[str] = Field(
        default=[], description="Parameters (names or patterns) whose profile likelihood is computed."
    )
    posterior: bool = Field(
        default=False,
        description='Sample the posterior of the parameters. Needs `pip install "seatruth[posterior]"`.',
    )
    posterior_steps: Annotated[int, Field(ge=1, le=MOST_STEPS)] = Field(
        default=STEPS,
        description="Steps of that sample at most; it ends after 100 autocorrelation times.",
    )


class FormulaTable(Table):
    """A static formula instead of a model: y = f(columns, parameters)."""

    expression: str = Field(
        description='Equation, as "D = (a1*Fr**3 + a2*Fr) / T". Names in [parameters] are parameters, the others '
        "columns."
    )
    file: str = Field(description="Table of data of any format of `seatruth list readers`, relative to the study file.")
    trial: str | None = Field(
        None,
        description="Column that distinguishes conditions, as the draft: rows with the same entry are one trial, and "
        "`cross_validate` predicts each trial from the others. Default: `cross_validate` leaves out a tenth of the "
        "rows at a time.",
    )


class StudyFile(Table):
    """A whole study file."""

    study: StudyTable = StudyTable()
    model: ModelTable | None = None
    formula: FormulaTable | None = None
    parameters: dict[str, Annotated[ParameterTable, as_table("value")]] = Field(default={})
    actuators: dict[str, Annotated[ActuatorTable, as_table("record")]] = Field(default={})
    time: Annotated[TimeTable, as_table("column")] = TimeTable()
    frames: FramesTable = FramesTable()
    channels: Channels = Field(default={})
    files: FilesTable = FilesTable()
    trials: list[TrialTable] = Field(default=[])
    prepare: list[PrepareTable] = Field(default=[])
    noise: dict[str, float | str] = Field(default={})
    cost: CostTable = CostTable()
    optimizer: Annotated[list[OptimizerTable], BeforeValidator(as_list)] = Field(default=[OptimizerTable()])
    budget: BudgetTable = BudgetTable()
    output: OutputTable = OutputTable()

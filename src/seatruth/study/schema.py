"""The schema of the study file as pydantic models.

Every table and key of a study file is a field here with its description; docs/study-file.md is generated from them. The
models check types and spelling only. Checks that need the model, the trials or the plug-ins (whether a parameter or a
file exists) run where the study is built.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, PositiveFloat, PositiveInt


class Table(BaseModel):
    """Base of every table: unknown keys and wrong types are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class OpenTable(Table):
    """A table whose further keys are the options of a plug-in or a preparation step."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True)

    @property
    def options(self) -> dict[str, Any]:
        """The keys that the schema does not name: options of what the table selects."""
        return dict(self.__pydantic_extra__ or {})


def _as_list(value: Any) -> Any:
    if isinstance(value, str):
        return [{"use": value}]
    return [value] if isinstance(value, dict) else value


def _as_table(key: str) -> BeforeValidator:
    """Lets a bare number or text stand for a table with one key."""

    def widen(value: Any) -> Any:
        return value if isinstance(value, (dict, bool)) else {key: value}

    return BeforeValidator(widen)


def _pair(value: Any) -> Any:
    numbers = isinstance(value, list) and len(value) == 2 and all(isinstance(item, (int, float)) for item in value)
    if numbers and value[0] > value[1]:
        raise ValueError(f"{value} is not in order, it must be [low, high]")
    return value


Pair = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2), BeforeValidator(_pair)]


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


class ModelTable(Table):
    """The vehicle's model."""

    use: str = Field(
        description='A model of `seatruth list models`, or your own model as "file.py:ClassName" (path relative to the '
        "study file). A study runs no code but such files of models and effects."
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


class PriorTable(Table):
    """A normal prior N(mean, sd) on a parameter."""

    mean: FiniteFloat = Field(description="Mean, in the parameter's unit.")
    sd: Annotated[FiniteFloat, Field(gt=0)] = Field(description="Standard deviation, in the parameter's unit.")


class ParameterTable(Table):
    """One parameter, in the unit of the model. A bare number is short for `{ value = number }`."""

    value: FiniteFloat | None = Field(
        default=None, description="Value, from which the search starts; default: the model's."
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


class ChannelTable(Table):
    """The column of the files that holds a channel of the model. A bare text is short for `{ column = text }`."""

    column: str | None = Field(default=None, description="Column of the file; default: the channel's name.")
    unit: str | None = Field(
        default=None, description='Unit in the file, as "deg/s"; default: the unit the model uses.'
    )
    sign: Literal[-1, 1] = Field(default=1, description="-1 if the file has the opposite sign convention.")
    scale: FiniteFloat = Field(default=1.0, description="Factor on the numbers, in addition to the unit.")
    offset: FiniteFloat = Field(
        default=0.0, description="Added to the numbers, in the model's unit (SI; rad; rev/s), after sign and scale."
    )
    invalid_where: str | None = Field(
        default=None, description='Samples that are not valid, as a condition on the file\'s columns: "pos_hold == 1".'
    )
    vector: Annotated[list[str], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="Columns of an angle's cosine and sine, in place of `column`."
    )
    quaternion: Annotated[list[str], Field(min_length=4, max_length=4)] | None = Field(
        default=None,
        description="Columns w, x, y, z of the turn from body to earth axes, in place of `column` (phi, theta, psi).",
    )
    declination: FiniteFloat | str = Field(
        default=0.0,
        description='Added to a magnetic heading or course, east positive: "3.5 deg", or a number in rad.',
    )
    time: str | None = Field(
        default=None,
        description="Column with the channel's own clock, where it has one. An output keeps its own times; inputs are "
        "interpolated as `hold` of [cost] says.",
    )
    measures: str | None = Field(
        default=None,
        description='What the instrument measures, as "sog" (docs/channels.md lists the names); default: what the '
        "channel's name says. The model gets it as an output.",
    )
    at: Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)] | None = Field(
        default=None,
        description="Place [x, y, z] of the sensor, m forward, starboard and down of the model's origin (default).",
    )
    extra: bool = Field(
        default=False,
        description="True for a channel that is neither in the model nor in the standard list; only preparation steps "
        "use it.",
    )


class ActuatorTable(Table):
    """What the record of an input holds. A bare text is short for `{ record = text }`."""

    record: Literal["acting", "order"] = Field(
        default="acting",
        description="acting: what the actuator did, as a measured rudder angle. order: what it was told to do; a servo "
        "then stands between the record and the model.",
    )
    lag: PositiveFloat | str | None = Field(
        default=None,
        description='Time constant of the servo, as "0.5 s". It becomes the parameter NAME_lag, which a fit can free.',
    )
    rate_limit: PositiveFloat | str | None = Field(
        default=None,
        description='Fastest rate of the servo, as "2.3 deg/s". It becomes the parameter NAME_rate_limit.',
    )
    delay: PositiveFloat | str | None = Field(
        default=None,
        description='Dead time of the servo, as "0.2 s"; known. To identify one, add the effect rudder_delay.',
    )


class TimeTable(Table):
    """The time column. A bare text is short for `{ column = text }`."""

    column: str = Field(default="t", description="Column of the file.")
    unit: str | None = Field(
        default=None,
        description='Unit; "date" for dates with times; "hhmmss" for NMEA\'s times of day. Default: the unit of the '
        "header, or what the numbers can be (epochs since 1970, dates, times of day, hhmmss), else s.",
    )
    dates: Literal["day-first", "month-first"] | None = Field(
        default=None, description="Order of dates such as 03.07.2025; needed where no day is above 12."
    )
    date: str | None = Field(
        default=None, description="Column with the date, where the time column holds the time of day alone."
    )
    jumps: PositiveFloat | None = Field(
        default=None,
        description="s; the clock was set where time runs back, or on by more than this: the usual step takes the "
        "place of the jump. Default: a time that runs back is refused, a pause is kept.",
    )
    repeated: Literal["refuse", "first", "last"] = Field(
        default="refuse", description="Samples with the same time: refuse the file, or keep the first or the last."
    )


class FramesTable(Table):
    """The axes of the log, where they are not seatruth's (x north, y east, z down; x forward, y to starboard)."""

    earth: Literal["NED", "ENU"] = Field(
        default="NED",
        description='"ENU": x is east, y north, z up, and psi counter-clockwise from east. Default: north, east, down.',
    )
    body: Literal["FRD", "FLU"] = Field(
        default="FRD",
        description='"FLU": y is to port, z up; velocities, rates, accelerations and theta change their sign as they '
        "must. Rudders do not.",
    )
    origin: Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)] | None = Field(
        default=None,
        description="Latitude and longitude of x = y = 0, degrees; default: the first fix of the first trial.",
    )
    utm: str | None = Field(default=None, description='Zone of the channels northing and easting, as "32 north".')


class FilesTable(OpenTable):
    """Format of the files; needed only where the guess is wrong. The further keys are options of readers."""

    reader: str | None = Field(default=None, description="A reader of `seatruth list readers`; default: recognised.")
    separator: str | None = Field(default=None, description='"," ";" "|" "tab" or "space"; default: guessed.')
    decimal: Literal[".", ","] | None = Field(default=None, description="Decimal mark; default: guessed.")
    encoding: str | None = Field(default=None, description='As "utf-8" or "latin-1"; default: guessed.')
    variable: str | None = Field(default=None, description="Variable of a MATLAB or HDF5 file that holds the columns.")

    @property
    def reading(self) -> dict[str, Any]:
        """What the study says of the files, as options of `read_log`."""
        return {**self.model_dump(exclude_none=True), **self.options}


Channels = dict[str, Annotated[ChannelTable, _as_table("column")]]


class PrepareTable(OpenTable):
    """One preparation step; the further keys are its options. Steps run in the order of the file."""

    step: str = Field(description="Name of the step.")
    trials: list[str] | None = Field(
        default=None, description="Names or patterns of the trials to which a shared step applies; default: all."
    )


class TrialTable(Table):
    """One recorded run, or several with one entry."""

    name: str | None = Field(default=None, description="Name; default: the file's name without its ending.")
    file: str = Field(
        description="Log in a format of `seatruth list readers`, relative to the study file. A pattern "
        "(`zigzag_*.csv`) makes every "
        "matching file a trial."
    )
    where: str | None = Field(
        default=None,
        description="Rows of the file that belong to this trial, as a condition on its columns (`run == 2`, "
        "`run == 'zigzag 1'`); default: all. `seatruth trials` writes it.",
    )
    role: Literal["fit", "holdout"] = Field(
        default="fit", description='"fit" takes part in the fit; "holdout" is only predicted.'
    )
    time: Annotated[TimeTable, _as_table("column")] | None = Field(
        default=None, description="Overrides [time] for this trial."
    )
    channels: Channels = Field(default={}, description="Overrides [channels] for this trial, key by key.")
    without: list[str] = Field(default=[], description="Outputs of the model that this trial did not record.")
    conditions: dict[str, str | float | bool] = Field(
        default={}, description="Conditions of the run (loading, depth, sea state); kept with the result."
    )
    prepare: list[PrepareTable] = Field(
        default=[], description="Steps for this trial alone; they run before the shared [[prepare]] steps."
    )


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
        default="fixed", description="Initial state of each trial: taken from its first samples, or estimated."
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


class BudgetTable(Table):
    """Limits at which a search stops."""

    evaluations: PositiveInt | None = Field(
        default=None, description="Simulations of all trials, finite differences counted."
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
    parameters: dict[str, Annotated[ParameterTable, _as_table("value")]] = {}
    actuators: dict[str, Annotated[ActuatorTable, _as_table("record")]] = {}
    time: Annotated[TimeTable, _as_table("column")] = TimeTable()
    frames: FramesTable = FramesTable()
    channels: Channels = {}
    files: FilesTable = FilesTable()
    trials: list[TrialTable] = []
    prepare: list[PrepareTable] = []
    noise: dict[str, float | str] = {}
    cost: CostTable = CostTable()
    optimizer: Annotated[list[OptimizerTable], BeforeValidator(_as_list)] = [OptimizerTable()]
    budget: BudgetTable = BudgetTable()
    output: OutputTable = OutputTable()

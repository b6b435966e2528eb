"""The tables of the study file that say what was recorded and how: trials, files, time, axes, channels, steps."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, PositiveFloat

from seatruth.study.schema_base import OpenTable, Table, as_table


def _one_column(given: Any) -> Any:
    if isinstance(given, list):
        raise ValueError("a channel has one column; for the mean of several write mean = [...]")
    return given


class ChannelTable(Table):
    """The column of the files that holds a channel of the model. A bare text is short for `{ column = text }`."""

    column: Annotated[str | None, BeforeValidator(_one_column)] = Field(
        default=None, description="Column of the file; default: the channel's name."
    )
    mean: Annotated[list[str], Field(min_length=2)] | None = Field(
        default=None,
        description="Columns in one unit whose mean the channel is, in place of `column`, as those of twin rudders or "
        "shafts.",
    )
    unit: str | None = Field(
        default=None,
        description='Unit in the file, as "deg/s"; default: the unit that the header states, else the one the model '
        "uses. A pressure is a depth for `z` and `depth` (docs/channels.md).",
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
        "interpolated as their `hold` says.",
    )
    value: FiniteFloat | None = Field(
        default=None,
        description="Of an input that was not recorded: the number that it had throughout, in `unit`, in place of a "
        "column.",
    )
    hold: Literal["foh", "zoh"] | None = Field(
        default=None,
        description="Of an input, between its samples: foh (straight lines), as what was measured, or zoh (constant), "
        "as orders; default: `hold` of [cost].",
    )
    measures: str | None = Field(
        default=None,
        description='What the instrument measures, as "sog" (docs/channels.md lists the names); default: what the '
        "channel's name says. The model gets it as an output.",
    )
    at: Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)] | None = Field(
        default=None,
        description="Place [x, y, z] of the sensor, m forward, starboard and down of the model's origin (default). "
        "That of latitude or longitude is the antenna's, and holds for both.",
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


Channels = dict[str, Annotated[ChannelTable, as_table("column")]]


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
    split_at_gaps: bool = Field(
        default=False,
        description="True: after each pause of the sampling (more than 5 steps) a trial of its own begins, NAME_1, "
        "NAME_2, ...; what the inputs did in a pause is not known.",
    )
    time: Annotated[TimeTable, as_table("column")] | None = Field(
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

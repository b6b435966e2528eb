"""Every threshold of the checks, with its reason. A finding must be true, so each is set on the cautious side."""

# Time
GAP_STEPS = 5.0
"""A pause longer than this many sampling steps: interpolating or holding the inputs over it is then a poor guess."""
JITTER = 0.1
"""Sampling steps that differ from their median by this part of it: filters and derivatives need resampled data."""
FEW_SAMPLES = 20
"""Below this a manoeuvre cannot be distinguished from noise."""
MISSING_PART = 0.5
"""A channel that is mostly not valid hardly constrains anything."""
LONG_MISSING_PART = 0.05
"""A single stretch without valid samples this long, as a part of the trial, is worth knowing."""
REGULAR_PART = 0.8
"""Part of a channel's steps that are as long as its usual one, to a sample: a slower sensor that lost a few."""
LATE_START = 5
"""Samples without a value at a trial's start: an initial state from a later sample is then another moment's."""

# Units and frames, from one channel alone
ANGLE_LIMIT = 3.5
"""rad: no rudder, pitch or roll goes beyond half a turn (3.14) plus a margin; in degrees nearly all do."""
HEADING_SPAN = 130.0
"""rad, 20 turns: no manoeuvre turns that far in one sense; 130 degrees of heading is a modest turn."""
FULL_TURN = 6.3
"""rad: a full turn and its last digit; an angle that jumps by a turn never exceeds it."""
TURN_BACK = 0.5
"""rad: two steps that add up to a full turn within this; the vehicle itself turns less over two samples."""
YAW_RATE = 6.0
"""rad/s: a full turn a second; numbers beyond it are degrees a second."""
SPEED = 40.0
"""m/s, 78 knots."""
PROPELLER = 60.0
"""rev/s, 3600 rpm: beyond what propellers of ships, models and AUVs turn at; a smaller number may be either unit."""
DEPTH_ABOVE = 1.0
"""m above the surface for half of the time: the depth counts upward, or it is a height."""

# Agreement between channels
WINDOWS = 40
"""The record is cut into about this many windows, over which changes of one channel are compared with integrals of
another: integrals keep the noise of derivatives out."""
MIN_WINDOWS = 8
"""With fewer windows, a correlation by chance is too likely."""
MAX_WINDOW = 10.0
"""s: longest window, so that an unsteady current is not mistaken for a fault of the sensors."""
ROTATION_NEEDED = 0.05
"""rad, rms change of an angle over a window: below it there is nothing to compare."""
AGREEMENT = 0.6
"""Squared correlation below which two channels that should agree do not."""
SCALE_AGREEMENT = 0.95
"""Squared correlation above which a scale factor is worth stating."""
SCALE_OFF = 0.05
"""Scale errors below 5 % are calibration and belong to the fit; above it something is wrong."""
DEPTH_OFF = 0.25
"""Logarithm of the scale of a depth, beyond any calibration and beyond what a noisy heave velocity hides: wrong units.
[S]"""
DEPTH_TURNED = 0.5
"""Change of a depth over what the speeds say, beyond which, below zero, it counts upward: in waves a pressure cell has
a small part of the heave, in any phase. [S]"""
KNOWN_SCALE = 0.06
"""How near a scale must be to 57.3 or 0.5144 to be called degrees or knots."""
SCALE_KEPT = 0.5
"""Part of a scale error, as a logarithm, that displacements must show without a drift beside it: what shows beside one
alone may be of the clocks. [S]"""
SIGNIFICANT = 4.0
"""Standard errors: about one chance in 16,000, so that forty checks of forty trials stay quiet on good data."""
HEADING_OFF = 0.06
"""rad, 3.4 deg: larger than a compass's deviation; basin axes that are not those of the heading show as more."""
HEADING_APART = 0.26
"""rad, 15 deg: beyond a compass, and beyond the drift of a ship that turns to one side by 0.1 rad over a window. [S]"""
HALF_TURN = 0.2
"""rad, 11 deg: a heading within this of half a turn off is one that points astern, with a compass's deviation."""
EXPLAINED = 0.35
"""A fault is named only if undoing it brings the disagreement down to this part of what it was."""
DISAGREEMENT = 0.1
"""rms disagreement of displacements over their rms: below it no fault of sign or axes is looked for."""
ASTERN = 0.8
"""Part of the way that is made opposite to the heading, over a quarter turn and more, before psi is called reversed."""
DRIFT_PART = 0.05
"""Steady drift of the position against u, v and psi, as a part of the speed, that is worth knowing."""
MIN_ARM = 0.1
"""m: a position sensor farther than this from the point whose velocity is recorded is worth knowing ..."""
ARM_PART = 0.05
"""... if it also explains this part of the disagreement ..."""
ARM_TURN = 0.05
"""... and the heading ranges over this, rad (2.9 deg): with less, a metre of arm moves the position by less than 5 cm,
and the small errors of the integral look like an arm (chosen here [S])."""

# Clocks
MAX_LAG = 0.1
"""Part of the record up to which an offset of two clocks is looked for: beyond, a zigzag fits its next period."""
MIN_LAG = 0.1
"""s: shorter offsets are the filters of good sensors."""
LAG_STEPS = 0.75
"""... and sampling steps: half of one comes from a sensor that holds its value."""
LAG_EXPLAINS = 0.25
"""An offset is named only if undoing it leaves at most this part of the mean square of the disagreement."""

LAG_HALVES = 0.4
"""... and this part in each half of the record: a filter or a slipping clock is not an offset."""
LAG_TRIALS = 3
"""Trials from which an offset that they have in common is named, though none of them shows it so clearly alone, ..."""
LAG_SPREAD = 0.5
"""... where their own offsets spread over no more than this part of the mean, ... Of offsets that lie anywhere within
ten times the mean, three fall so near to each other once in a thousand times."""
LAG_TOGETHER = 0.5
"""... and undoing it leaves at most this part of the mean squares of the disagreement, on average."""

# The rudder against the turn
HOLD_SAMPLES = 5
"""Fewest samples in which a rudder is called held; over as many its angle is smoothed and the yaw rate averaged."""
HELD_BAND = 0.1
"""Part of the rudder's range within which it is held: more than the noise and play of an indicator."""
MOVED_PART = 0.25
"""Part of the rudder's range below which a movement is a correction of the helm."""
RUDDER_AGREEMENT = 0.6
"""Correlation of yaw rate with rudder movements beyond which, below zero, the bow turns against the rudder ..."""
RUDDER_CHANCE = 0.01
"""... if unrelated movements would agree so badly less often than this. Chosen here [S]: between a right log, in which
they agree by 0.9 and more, and a wrong one lies far more than chance; and three good movements suffice."""
HARD_OVER = 0.15
"""rad, 8.6 deg: no unstable ship turns against a rudder as large as this (the loops of spiral tests end earlier)."""

# Sensors
TREND_SAMPLES = 6
"""Samples to each side over which a channel's local speed is taken: long against one hold."""
HELD_PART = 0.01
"""Part of the samples in fast motion (the fastest quarter) that repeat the one before exactly."""
MIN_HOLDS = 8
"""Smallest number of holds in fast motion from which the step after a hold can be estimated."""
HELD_CHANCE = 2e-4
"""Probability of so many repeats in rounded noise below which a sensor held them: [S] one wrong note in 5000."""
HELD_CATCH_UP = 1.25
"""Step after a repeated value over the usual step: 2 after one held sample, 1 if rounding made the repeat."""
STUCK_PART = 0.1
"""Part of the trial (at least STUCK_SECONDS) that a sensor gives one value while related channels move."""
STUCK_SECONDS = 5.0
SELDOM_SAME = 0.2
"""Part of a sensor's steps that change nothing, up to which noise moves it: ten samples alike are then no chance."""
FROZEN_PATH = 0.1
"""Part of the distance sailed that lies along an axis: a course nearer to square (6 deg) leaves that position alone."""
FROZEN_DISTANCE = 1.0
"""m: less may be the drift of noise in the velocities."""
FROZEN_ALONG = 0.2
"""Cosine of 78 deg: on a course further from an axis than that, the position on it hardly tells the other one."""
FROZEN_TURN = 0.5
"""rad, 29 deg: a vehicle that turns so far slips sideways by more than any instrument's last digit."""
FROZEN_SPEED = 0.2
"""Part of the speed over the ground by which it changes; position noise makes up some of it, so not less."""
QUANTISED_PART = 0.02
"""Resolution over the middle 90 % of a channel's range: coarser shows as steps in any plot of the residuals."""
COARSER = 8.0
"""Resolution in a part of the record over that in the rest."""
COARSE_STEPS = 8
"""Smallest number of plateaus with equal steps that show a coarser resolution ..."""
COARSE_PART = 0.05
"""... and the smallest part of the record that they must fill."""
OUTLIER_SIGMAS = 8.0
"""Distance from a line through eleven neighbours, in their robust standard deviation: one in 1e15 for normal noise."""
OUTLIER_STEPS = 10.0
"""... and in the channel's typical bend from sample to sample."""
JUMP_SIGMAS = 15.0
JUMP_STEPS = 15.0
JUMP_PART = 0.5
"""A step in position against its neighbours, in their robust standard deviation, in typical steps,
and in the usual speed."""

# Excitation
STILL = 1e-9
"""Relative range below which an input is constant."""
SMALL_ANGLE_INPUT = 0.02
"""rad, 1.1 deg: smaller rudder movements are lost in play and noise."""
COARSE_INPUT_STEP = 0.35
"""Part of an input's range that it crosses between two samples: its course between them is then unknown."""
CORRELATION_SAMPLES = 1.5
"""A rate must stay correlated (above 1/e) for more samples than this: a sine has then eight samples a period."""
TURNING_PART = 0.25
"""... if the angle follows it: squared correlation of what both change by between two samples."""
HEADING_COVERAGE = 1.5708
"""rad: below a quarter turn, a current looks like a speed error or a heading offset."""
SPEED_RANGE = 0.1
"""Relative speed range below which linear and quadratic drag cannot be distinguished."""
SAME_ROWS = 20
"""Distinct samples that two trials must have in common, in every channel, to hold the same recording."""

"""Every number that a diagnosis rests on, with its unit, meaning and origin.

Origins: a paper, a derivation, "[C]": calibrated by `experiments/withheld calibrate` on development cases, which with
their hash are in `experiments/withheld/calibration.json`, or "[S]": chosen here by judgement, for the reason that
stands beside it.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Settings of `diagnose`.

    Example:
        >>> Settings().knots
        12
    """

    coefficient_sd: float = 0.2
    """Prior standard deviation of a free coefficient that states none, as a part of its value. [S] Semi-
    empirical estimates of manoeuvring derivatives are often that far off."""
    prior_width: float = 2.5
    """Prior standard deviation of an effect's magnitude over its typical one. [S] Typical is no limit: 2.5 puts two
    fifths of the prior beyond twice the typical magnitude."""
    initial_width: float = 10.0
    """Prior standard deviation of an initial state over the spread of its record. [S] As good as unknown."""
    near_orders: bool = True
    """Whether actuators begin each trial near their orders; a search drops it where they do not (`actuator_starts.py`).
    """
    sections: int = 1
    """Sections of the longest trial; a search sets it where whole runs cannot be fitted (`sections.py`)."""
    knots: int = 12
    """Knots of the forces of each trial over the longest one, to begin with. [S] A gap that changes within a twelfth of
    a trial is left to terms and noise, unless forces explain much: then the trials choose (`refinement.py`)."""
    force_memory: float = 1.5
    """Knots over which a trial's own missing force keeps its sign (exponential correlation). [S]"""
    noise_ratios: tuple[float, ...] = (0.3, 0.6, 1.0, 1.7, 3.0, 6.0)
    """Slow part of the sensor noise over the white one, the grid of its standard deviation. GPS, gyro and filtered
    channels: 0.3 to 2; 6 for channels that were filtered before they were recorded. [S]"""
    noise_times: tuple[float, ...] = (1.0, 3.0, 10.0, 30.0, 60.0)
    """s, grid of its correlation time; bounded, since a random walk of a position would hide every slow cause. [S]"""
    noise_ratio: float = 0.8
    """Median of that ratio. [S] Slow errors of GNSS, gyro and log are 0.3 to 2 times the white ones."""
    noise_ratio_spread: float = 0.6
    """Standard deviation of its logarithm. [S] 0.3 and 2 are at one and a half deviations."""
    declared_noise_sd: float = 0.2
    """Standard deviation of the logarithm of the white noise about a declared value: data sheets are right to some
    20 %. [S]"""
    smallest_discrepancy: float = 1e-4
    """Size of a missing acceleration, as a part of the usual one, below which it counts as none. [S] Below what any
    recorded trial resolves."""
    scales: tuple[float, ...] = (4.0, 1.0, 0.25, 0.0625, 0.015625)
    """Parts and multiples of an effect's prior deviation over which its evidence is averaged: its order of magnitude is
    unknown, with `prior_width` from ten times a typical one to a 25th of it. Weak causes that long trials show, as a
    wind of 5 cm/s on a model ship, lose five nats without the last. One wide prior would over-penalise weak effects
    (Lindley's paradox), one of thin tails strong ones: a log with a bias of five deviations would lose twelve nats to a
    scale error that is none. [S]"""
    wider: tuple[tuple[str, float], ...] = ()
    """Effects with a wider prior than is believed, and its deviation over that; a search sets it (`gross_sizes.py`)."""
    fit_steps: int = 30
    """Most Gauss-Newton steps of one fit. [S] Four to eight are usual."""
    settled: float = 0.05
    """Fall of the objective (nats) below which a fit has converged. [S] Small beside the 1 nat that could change an
    answer."""
    hopeless: float = 30.0
    """Log-evidence (nats) behind the best hypothesis beyond which a fit is broken off: a probability of 1e-13."""
    singles: int = 10
    """Effects fitted alone in full, the leaders of the linearized likelihood. [S]"""
    leaders: int = 3
    """Sets to which further effects are added. [S]"""
    additions: int = 3
    """Effects added to each of them. [S]"""
    most_effects: int = 3
    """Effects in one hypothesis. [S] Four causes at once were never found by any record we have."""
    worth_fitting: float = 1.0
    """Linearized log-evidence (nats) above the best fit for which a larger set is fitted: the prior of one more effect
    costs several times that. [S]"""
    prior_none: float = 0.176
    """Prior probability that nothing acts. [C]"""
    prior_unknown: float = 0.117
    """Prior probability of a cause that is not in the library. [C]"""
    prior_sets: tuple[float, ...] = (0.511, 0.181, 0.015)
    """Prior probability of one, two, three effects, shared equally among the sets of that size. [C]"""
    prior_discrepancy: float = 0.158
    """Prior probability that the model's structure lacks something beside named effects. [C]"""
    temperature: float = 1.0
    """Divides log-evidence; 1 takes the statistical model at its word. [C]"""
    size_temperature: float = 1.79
    """Divides the information about sizes. [C] Of an earlier set of 57 cases: of 11 sizes of a set of 48, intervals
    without it held 6, with it 10."""
    model_form: float = 0.053
    """What is added to the temperature for each nat that the best hypothesis explains: the form of an effect is never
    exact, and one whose amplitude is 20 % off leaves 0.2^2 = 4 % of its signature to its rivals. [C]"""
    unseen_form: float = 5.67
    """Nats of a wrong form that missing forces do not show beside an effect: they must pay for their freedom. [C]"""
    form_beside: float = 0.847
    """Part of what fewer effects explain that is counted so for a further effect beside them. [C]"""
    name_threshold: float = 0.6
    """Probability from which a cause is named, at whatever level of the tree reaches it. [S]"""
    set_coverage: float = 0.95
    """Probability that the effects reported together hold. Convention."""
    least_rival: float = 0.15
    """Probability, as a part of the leader's, below which a rival does not count as a look-alike. [S]"""
    least_alike: float = 0.1
    """The same for one that these trials cannot tell from the leader. [S]"""
    apart: float = 11.0
    """Pairwise noncentrality below which two effects count as not told apart: with it the wrong one of two wins in 5 %
    of records, as Phi(-sqrt(11) / 2) = 0.05."""
    significance: float = 0.05
    """One-sided level at which an effect's gain on trials left out must be positive. Convention."""
    gap: float = 1.1
    """Mean squared error over the noise variance from which a refitted model leaves a gap. [S] With the thousand
    effective samples of a usual study, chance stays below 1.1 in 99 % of records."""
    stray: float = 100.0
    """Mean squared error over the noise variance beyond which whole runs stray: ten noise deviations. [S]"""
    least_noncentrality: float = 6.6
    """Noncentrality below which an effect is not named: its size cannot be told from none at the level 0.01."""
    implausible: float = 4.0
    """Prior standard deviations (`prior_width` times the typical magnitude) beyond which an effect looks like a cause
    but is not said to be it. [S]"""
    small_share: float = 0.05
    """Part of the gap below which an effect is said to be a negligible part of it. [S]"""
    tiny: float = 0.07
    """Typical sizes below which an effect is next to nothing for what it is. [C] Of 77 causes that were named in nine
    opened sets of `experiments/withheld`, five of the six below 0.051 did not act, the sixth was a dead band of 0.037;
    the others began at 0.089."""
    power: float = 2.8
    """Standard deviations at which an effect is found with power 0.8 in a two-sided test at 0.05: 1.96 + 0.84."""

"""The sentences of a diagnosis beside its tables."""

from __future__ import annotations

from dataclasses import replace

from fake_diagnosis import diagnosis

from seatruth.diagnosis.sentences import chance
from seatruth.report.text import diagnosis as text
from seatruth.report.text import gap


def test_answers_beside_something_unknown_say_so() -> None:
    """'Unknown, over 99.9 %' stood above a table in which it had 52 %: the rest had it beside an effect."""
    found = diagnosis("unknown")
    (first, *_) = [one for one in found.hypotheses if one.effects]

    def told(*entries: tuple[bool, float]) -> str:
        sets = [replace(first, discrepancy=beside, probability=p) for beside, p in entries]
        none = replace(first, effects=(), discrepancy=True, probability=0.5)
        verdict = replace(found.verdict, probability=0.5 + sum(p for beside, p in entries if beside))
        return text.beside_answers_in_words(replace(found, verdict=verdict, hypotheses=(none, *sets)))

    assert told((True, 0.4), (False, 0.1)) == (
        "Where effects are the answer, something most probably acts beside them that is not in the library: alone or "
        "beside them 90 %."
    )
    assert told((True, 0.2), (False, 0.3)) == ""
    assert told((True, 0.01)) == ""
    # "Over 99.9 %" stood above 73.5 %: what trials left out did not bear out had the rest.
    refused = replace(found, verdict=replace(found.verdict, probability=0.9996))
    sets = [replace(first, discrepancy=False, probability=0.4)]
    none = replace(first, effects=(), discrepancy=True, probability=0.6)
    assert text.beside_answers_in_words(replace(refused, hypotheses=(none, *sets))).startswith("The headline counts")


def test_what_is_probable_and_not_named_is_told() -> None:
    """Of a boat waves stood in all five answers with 98 %, and nowhere else."""
    found = diagnosis("inseparable")
    named = {name for cause in found.verdict.causes for name in cause.effects}
    (other, *_) = [one for one in found.effects if one.name not in named]
    assert text.unnamed_in_words(found) == ""
    likely = replace(other, probability=0.98)
    found.effects = (*(one for one in found.effects if one.name != other.name), likely)
    assert text.unnamed_in_words(found) == (
        f"Probable in these fits, and not named, since nothing beyond them bears it out: {other.title} (98 %)."
    )
    found.verdict = replace(found.verdict, sentence=f"{found.verdict.sentence} It looks like {other.title}.")
    assert text.unnamed_in_words(found) == ""


def test_look_alikes_are_told_with_a_size_each() -> None:
    """Of two engines one gave 12 % less, or the other one 14 % more: the table had the size of one of them."""
    found = diagnosis("inseparable")
    (cause, *_) = found.verdict.causes
    sizes = tuple(f"k -0.1{k} +- 0.02" for k, _ in enumerate(cause.effects))
    assert len(sizes) > 1
    assert text.cause_size(found, replace(cause, sizes=sizes)).startswith("k -0.10 ± 0.02 or k -0.11 ± 0.02")
    assert text.remark(replace(cause, small=False, of_evidence=True)).startswith("share of what is explained")
    assert text.remark(replace(cause, small=False, over_typical=0.05)) == "small for what it is"


def test_effects_without_a_function_of_the_model_are_told_above_the_table() -> None:
    """A glider's model did not declare its drag, and a fouled hull passed for a depth sensor 20 % off."""
    found = diagnosis("unknown")
    found.unavailable = {"drag_increase": "the model does not declare its drag", "bank": "it acts on ship"}
    told = text.undeclared_in_words(found)
    assert told == (
        "The model does not declare its drag, so drag increase took no part. "
        "If it acts, the cause is unknown, or passes for another."
    )
    found.unavailable = {"bank": "it acts on ship"}
    assert text.undeclared_in_words(found) == ""


def test_the_place_of_what_fits_best_is_no_surer_than_the_verdict_that_refuses_it() -> None:
    """Of an ROV the arm of its log was refused, and "It most probably acts in the sensor of u (92 %)" stood below."""
    found = diagnosis("unknown")
    (place, p), *_ = gap.ranked(found.places)
    others = [replace(one, probability=0.01) for one in found.effects]
    found.effects = tuple(others)
    places, told = found.places, gap.where_in_words(found)
    assert p > 0.5
    assert told.startswith(f"It most probably acts in {gap.place_in_words(place)}")
    found.places = dict.fromkeys(found.places, 0.26)
    missing, found.discrepancy = found.discrepancy, None
    assert gap.where_in_words(found).startswith("It is not decided where it acts: the most probable places are ")
    assert missing is not None
    found.discrepancy = replace(missing, sizes={"yaw": 0.75, "surge": 0.39, "sway": 0.01}, log_evidence=1800.0)
    assert gap.where_in_words(found).startswith(
        "No effect decides where it acts; forces are missing in the yaw equation (75 % of its usual acceleration) and "
        "the surge equation (39 % of its usual acceleration)."
    )
    found.discrepancy = replace(found.discrepancy, log_evidence=0.5)
    assert gap.where_in_words(found).startswith("It is not decided where it acts")
    found.places = places
    found.effects = (replace(others[0], probability=0.92, acts_on=(place,)), *others[1:])
    told = gap.where_in_words(found)
    assert told.startswith(f"What fits best acts in {gap.place_in_words(place)} ({chance(p)})")
    assert "and is not named" in told


def test_of_two_thrusters_that_look_alike_either_may_be_where_it_acts() -> None:
    """Of a boat "it most likely acts in the actuator of n_port" stood beside "which these trials cannot tell apart"."""
    found = diagnosis("inseparable")
    (cause, *_), (first, second, *others) = found.verdict.causes, found.effects
    cause = replace(cause, effects=(first.name, second.name))
    found.verdict = replace(found.verdict, causes=(cause,), places=("actuator:n_port",))
    found.effects = (
        replace(first, acts_on=("actuator:n_port",)),
        replace(second, acts_on=("actuator:n_starboard",)),
        *others,
    )
    told = gap.where_in_words(found)
    assert told.startswith("It most likely acts in the actuator of n_port, or in the actuator of n_starboard.")
    found.effects = (found.effects[0], replace(second, acts_on=("actuator:n_port",)), *others)
    assert gap.where_in_words(found).startswith("It most likely acts in the actuator of n_port. ")


def test_what_the_most_probable_answer_holds_beside_what_is_named_is_no_next_answer() -> None:
    """Of an ROV "the next probable answer" had over 99.9 %, and the named one under 0.05 %."""
    found = diagnosis("effects")
    first = found.hypotheses[0]
    more = replace(first, effects=("current", "heading_bias"), probability=0.96)
    both = replace(found, hypotheses=(more, replace(first, probability=0.01)))
    assert text.which_in_words(both).endswith(
        "The most probable answer holds heading offset as well (96 %), which is not named."
    )
    other = replace(more, effects=("heading_bias",), probability=0.2)
    apart = replace(found, hypotheses=(first, other))
    assert text.which_in_words(apart).endswith("The next probable answer is heading offset (20 %).")


def test_noise_far_above_the_stated_one_is_told() -> None:
    """Of a boat whose simulator had another form, a heading of 0.5 deg had a noise of 2.9 deg that it "met"."""
    found = diagnosis("effects")
    assert "far above" not in gap.gap_in_words(found)
    u, psi, x = found.noise
    noise = (replace(u, declared=0.02), replace(psi, declared=0.002, slow=0.012), replace(x, declared=0.5))
    assert (
        "The noise was estimated far above what the study states for psi (6.1 times): motion that the model lacks may "
        "be in it."
    ) in gap.gap_in_words(replace(found, noise=noise))


def test_free_terms_that_were_not_fitted_are_not_compared() -> None:
    found = diagnosis("effects")
    assert found.validation is not None
    assert "Free terms" in text.validation_in_words(found)
    without = replace(found, validation=replace(found.validation, control=0.0))
    assert "Free terms" not in text.validation_in_words(without)


def test_a_trial_that_nothing_asks_for_is_told_as_such() -> None:
    """Under "cannot decide" it said that no two effects were left to separate."""
    for kind, said in (("unknown", "None is suggested"), ("effects", "No two effects of the library are left")):
        found = diagnosis(kind)
        suggested = diagnosis("effects").next_trial
        assert suggested is not None
        alone = replace(found, next_trial=replace(suggested, survivors=("current",)))
        assert text.next_in_words(alone).startswith(said)

"""Third step: the hashes are checked, the seal is opened, every program's verdicts are scored."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from seatruth.errors import BadInput
from seatruth.progress import remaining
from withheld.commits import doubts
from withheld.diagnose import MANIFEST
from withheld.generate import ASIDE
from withheld.goals import measures
from withheld.measures import Measure, Pair, groups, rivals_of, suggests, top
from withheld.next_trial import NONE_SUGGESTED, pairs_after
from withheld.programs.limit import limit
from withheld.same import plain_truth, plain_verdict, twins
from withheld.seal import digest_file, log, note, write
from withheld.verdicts import problems, verdict

ORACLE = "oracle"
LIMIT = "limit"
INSIDERS = (LIMIT, ORACLE)
"""Those who read the sealed part: scored beside the programs, none of them."""
LIBRARY = "seatruth"
BY = ("stratum", "family", "kind", "stated", "aside")
"""Fields of the truth by which all measures are given, too."""


def opened(out: Path) -> dict[str, dict[str, Any]]:
    """The truths by case, after their hashes were compared with what was published when they were sealed."""
    seal = json.loads((out / "public" / "seal.json").read_text(encoding="utf-8"))["sealed"]
    found = {}
    for name, digest in seal.items():
        file = out / "sealed" / f"{name}.json"
        if digest_file(file) != digest:
            raise BadInput(f"the seal of {name} is broken: its hash is another", where=str(file))
        found[name] = json.loads(file.read_text(encoding="utf-8"))
    return found


def said(out: Path, program: str) -> dict[str, dict[str, Any]]:
    """A program's verdicts by case, after their hashes were compared with its manifest and that with the log."""
    place = out / "verdicts" / program
    if not (place / MANIFEST).exists():
        raise BadInput(f"{program} has no hashed verdicts", where=str(place), do="Run the diagnose step first.")
    stamp = digest_file(place / MANIFEST)
    if not any(line.get("manifest") == stamp for line in log(out)):
        raise BadInput("the manifest is not the one that the log holds", where=str(place))
    found = {}
    for name, digest in json.loads((place / MANIFEST).read_text(encoding="utf-8"))["verdicts"].items():
        file = place / f"{name}.json"
        if digest_file(file) != digest:
            raise BadInput(f"the verdict on {name} was changed after it was hashed", where=str(file))
        found[name] = json.loads(file.read_text(encoding="utf-8"))
        wrong = problems(found[name])
        if wrong:
            raise BadInput(f"the verdict on {name} is not in form: {wrong[0]}", where=str(file))
    return found


def oracle(truth: Mapping[str, Any]) -> dict[str, Any]:
    """The verdict of one who knows the cause; what it closes is what the referee found."""
    closure = None
    if truth["oracle"]:
        value = truth["oracle"]["closure"]
        closure = {"value": value, "lower": value, "upper": value}
    return verdict(
        truth["case"], [(list(truth["effects"]), 1.0)], places=list(truth["places"]), set=list(truth["set"]),
        closure=closure,
    )  # fmt: skip


def pairs_of(
    out: Path, program: str, truths: Mapping[str, dict[str, Any]], referee: bool, workers: int = 1
) -> list[Pair]:
    """(truth, verdict) of a program; with `referee`, what its suggested trials would tell is worked out and kept."""
    if program == ORACLE:
        verdicts = {name: oracle(truth) for name, truth in truths.items()}
    elif program == LIMIT:
        verdicts = limits(out, truths, workers)
    else:
        verdicts = said(out, program)
    # Of programs that never suggest anything nobody asks whether a trial would have helped.
    judged = referee and program not in INSIDERS and any(suggests(own) for own in verdicts.values())
    asked = {name: _rivals(truths[name], own) for name, own in verdicts.items() if judged}
    kept = {name: out / "verdicts" / program / "next" / f"{name}.json" for name, rivals in asked.items() if rivals}
    jobs = [
        (truths[name], out / "public" / name, verdicts[name], asked[name], file)
        for name, file in kept.items()
        if not file.exists()
    ]
    _at_once([delayed(_next_judged)(*job) for job in jobs], workers, f"{program}: suggested trials")
    found: list[Pair] = []
    for name, own in verdicts.items():
        truth = {**truths[name], "aside": truths[name]["family"] in ASIDE}
        if name in kept:
            truth = {**truth, "next": json.loads(kept[name].read_text(encoding="utf-8"))}
        found.append((plain_truth(truth, twins()), plain_verdict(own, twins())))
    return found


def _rivals(truth: Mapping[str, Any], own: Mapping[str, Any]) -> list[str]:
    """Effects from which a case's cause is to be told, by all their names."""
    twin = twins()
    found = rivals_of((plain_truth(truth, twin), plain_verdict(own, twin)))
    return [name for values in truth["pairs"].values() for name in values if twin.get(name, name) in found]


def _next_judged(
    truth: Mapping[str, Any], public: Path, own: Mapping[str, Any], rivals: Sequence[str], kept: Path
) -> None:
    """Runs a suggested trial in reality and keeps what it would tell; where none is suggested, some of the menu."""
    # Its matrices are small: threads of the linear algebra in every worker only stand in each other's way.
    with threadpool_limits(limits=1, user_api="blas"):
        if suggests(own):
            after: dict[str, Any] = pairs_after(truth, public, own["next_trial"]["manoeuvre"], rivals)
        else:
            tried = {words: pairs_after(truth, public, words, rivals) for words in NONE_SUGGESTED}
            after = {words: of for words, of in tried.items() if of}
    kept.parent.mkdir(exist_ok=True)
    write(kept, json.dumps(after) + "\n")


def limits(out: Path, truths: Mapping[str, dict[str, Any]], workers: int) -> dict[str, dict[str, Any]]:
    """What the limit says of every case; kept beside the sealed part, as it is worked out from that."""
    place = out / "sealed" / LIMIT
    place.mkdir(exist_ok=True)
    missing = [name for name in truths if not (place / f"{name}.json").exists()]
    jobs = [delayed(_limit_kept)(truths[name], out / "public" / name, place / f"{name}.json") for name in missing]
    _at_once(jobs, workers, "the limit")
    return {name: json.loads((place / f"{name}.json").read_text(encoding="utf-8")) for name in truths}


def _at_once(jobs: Sequence[Any], workers: int, what: str) -> None:
    """Runs jobs in so many processes, and says how far they are and how long it will take."""
    begin = time.perf_counter()
    done = Parallel(n_jobs=max(1, min(workers, len(jobs))), return_as="generator_unordered")(jobs)
    for number, _ in enumerate(done, 1):
        left = remaining(number, len(jobs), time.perf_counter() - begin)
        print(f"[{number}/{len(jobs)}] {what}, {0.0 if left is None else left / 60.0:.0f} min to go", flush=True)


def _limit_kept(truth: Mapping[str, Any], public: Path, kept: Path) -> None:
    with threadpool_limits(limits=1, user_api="blas"):
        try:
            found = limit(truth, public)
        except np.linalg.LinAlgError as problem:
            found = verdict(truth["case"], [], declared=False, failed=f"LinAlgError: {problem}")
    write(kept, json.dumps(found) + "\n")


def programs_of(out: Path) -> list[str]:
    """Programs whose verdicts are complete and hashed, the library's first; the limit and the oracle."""
    ready = sorted(folder.parent.name for folder in (out / "verdicts").glob(f"*/{MANIFEST}"))
    return [*sorted(ready, key=lambda name: name != LIBRARY), *INSIDERS]


def score(out: Path, workers: int = 1) -> dict[str, list[Pair]]:
    """Scores every program; writes score.json and returns the pairs by program for the page.

    Suggested trials are run by so many processes; the result does not depend on how many.
    """
    names = programs_of(out)
    order = [(line["step"], line["what"]) for line in log(out)]
    if ("generate", "end") not in order or ("diagnose", "end") not in order:
        raise BadInput("nothing was diagnosed", where=str(out), do="Run generate and diagnose first.")
    hashed = {name: digest_file(out / "verdicts" / name / MANIFEST) for name in names if name not in INSIDERS}
    note(out, "score", "begin", {"manifests": hashed})
    sealed = opened(out)
    # Of a set that was diagnosed in part, everybody is asked about the same part.
    truths = {name: sealed[name] for name in sorted({name for own in hashed for name in said(out, own)})}
    pairs = {name: pairs_of(out, name, truths, referee=True, workers=workers) for name in names}
    prior, best = ({truth["case"]: own for truth, own in pairs.get(name, [])} for name in ("prior", LIMIT))
    table = {name: encoded(measures(of, prior, best)) for name, of in pairs.items()}
    first = names[0]
    parts = {
        key: {name: encoded(measures(of, prior, best)) for name, of in groups(pairs[first], key).items()} for key in BY
    }
    truths = {truth["case"]: dict(truth) for truth, _ in pairs[ORACLE]}
    cases = [
        {
            "case": name, "family": truth["family"], "kind": truth["kind"], "stratum": truth["stratum"],
            "stated": truth["stated"],
            "effects": truth["effects"], "set": truth["set"], "lambda": truth["lambda"],
            "right": {program: "●" if top(pair, 1) else "✖" for program, of in pairs.items() for pair in of
                      if pair[0]["case"] == name},
            **{program: _short(of[name]) for program, of in _by_case(pairs).items() if name in of},
        }
        for name, truth in truths.items()
    ]  # fmt: skip
    settings = json.loads((out / "sealed" / "_set.json").read_text(encoding="utf-8"))
    content = {
        "synthetic": True, **settings, "first": first, "programs": table, "parts": parts, "cases": cases,
        "sealed": len(sealed),
        "doubts": doubts(log(out), [name for name in names if name not in INSIDERS]), "log": log(out),
    }  # fmt: skip
    write(out / "score.json", json.dumps(content, indent=1) + "\n")
    note(out, "score", "end", {"score": digest_file(out / "score.json")})
    return pairs


def encoded(found: Sequence[Measure]) -> list[dict[str, Any]]:
    """Measures for a file: what is no number is null."""
    rows = [asdict(one) for one in found]
    return [
        {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
        for row in rows
    ]


def _by_case(pairs: Mapping[str, list[Pair]]) -> dict[str, dict[str, Mapping[str, Any]]]:
    return {name: {truth["case"]: own for truth, own in of} for name, of in pairs.items() if name != ORACLE}


def _short(own: Mapping[str, Any]) -> str:
    if own.get("failed"):
        return f"no verdict: {own['failed']}"
    best = own["candidates"][:1]
    chance = f" ({float(best[0]['probability']):.2f})" if best else ""
    named = (" + ".join(best[0]["effects"]) or "nothing") if best else "-"
    among = f"; set {', '.join(own['set'])}" if own["set"] else ""
    return f"{own['verdict']}: {named}{chance}{among}"

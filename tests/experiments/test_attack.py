"""The attack itself: it notices what gives way, and its cases can be made."""

from __future__ import annotations

import math
import sys
import time
import types
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments"))

import outcomes
from attack import boat, fuzz, guard, hostile, inputs, models, parts

from seatruth.errors import BadInput
from seatruth.simulate import evaluate_rhs


def refuses() -> None:
    raise BadInput("it is wrong")


@pytest.mark.parametrize(
    ("function", "kind", "reason"),
    [
        (lambda: None, "answered", ""),
        (refuses, "refused", "it is wrong"),
        (lambda: 1 / 0, "gave way", "ZeroDivisionError"),
        (lambda: time.sleep(60), "gave way", "more than"),
        (lambda: bytearray(8 * 2**30), "gave way", "MemoryError"),
        (lambda: sys.exit(3), "gave way", "SystemExit"),
    ],
)
def test_whatever_is_neither_an_answer_nor_a_refusal_gives_way(
    function: object, kind: str, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guard, "SECONDS", 0.2)
    monkeypatch.setattr(guard, "WAITING", 2.0)
    verdict = guard.call(function, (BadInput,))
    assert verdict.kind == kind
    assert reason in verdict.reason


def test_an_endless_loop_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    def endless() -> None:
        while True:
            pass

    monkeypatch.setattr(guard, "SECONDS", 0.2)
    assert guard.call(endless, (BadInput,)).kind == "gave way"


def test_commands_are_judged_by_what_a_user_sees(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert guard.command(["list", "costs"]).kind == "answered"
    assert guard.command(["identify", str(tmp_path / "none.toml")]).kind == "refused"
    monkeypatch.setattr("seatruth.commands.list_installed.console", lambda: 1 / 0)
    assert guard.command(["list", "models"]).kind == "gave way"


def test_coverage_leads_from_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What gave way is kept alone: a corpus beside it would look like inputs that did."""

    class Ended(Exception):
        pass

    class Atheris(types.ModuleType):
        """Stands in for libFuzzer: gives what it finds in the folder of its last argument."""

        def instrument_func(self, function: object) -> None: ...

        def Setup(self, line: list[str], one: Callable[[bytes], None]) -> None:
            self.corpus, self.one = Path(line[-1]), one

        def Fuzz(self) -> None:
            for file in sorted(self.corpus.iterdir()):
                self.one(file.read_bytes())

    def ended(tally: fuzz.Tally) -> NoReturn:
        raise Ended(tally.tried, tally.failed)

    monkeypatch.setitem(sys.modules, "atheris", Atheris("atheris"))
    target = inputs.Target("numbers", (b"1", b"x"), (), float)
    kept, corpus = tmp_path / "gave way", tmp_path / "corpus" / "numbers"
    with pytest.raises(Ended, match="2, 1"):
        fuzz.guided(target, 2, 1, kept, corpus, math.inf, ended)
    assert [file.read_bytes() for file in kept.iterdir()] == [b"x"]
    assert len(list(corpus.iterdir())) == 2


def test_the_same_seed_makes_the_same_inputs(tmp_path: Path) -> None:
    (target,) = inputs.targets(tmp_path, ["logs"])
    first, again, other = (list(fuzz.mutants(target, 20, seed)) for seed in (1, 1, 2))
    assert first == again != other
    tally = fuzz.run(target, 20, 1, tmp_path / "kept")
    assert (tally.tried, tally.failed) == (20, 0), tally.gave_way


def test_a_wrong_number_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (target,) = inputs.targets(tmp_path, ["expressions"])
    monkeypatch.setattr("seatruth.expression.Expression.evaluate", lambda self, values: 7.0)
    tally = fuzz.Tally("wrong")
    fuzz.judge(target, b"a + b", tally, tmp_path / "kept")
    assert tally.failed == 1
    assert "Python says 1.0" in tally.gave_way[0]
    assert [path.read_bytes() for path in (tmp_path / "kept").iterdir()] == [b"a + b"]


def test_a_few_models_agree_with_python_and_a_wrong_engine_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert [models.compare(seed) for seed in (92, 104)] == [None, None]  # these two once did not
    right = evaluate_rhs
    monkeypatch.setattr(models, "evaluate_rhs", lambda *given, **more: right(*given, **more) * 1.0001)
    found = models.compare(5)
    assert found is not None
    assert "instead of" in found.what


def test_hostile_cases_have_names_of_their_own_and_can_be_made(tmp_path: Path) -> None:
    cases = list(hostile.cases())
    assert len({name for name, _ in cases}) == len(cases) > 150
    for number, (name, case) in enumerate(cases[::12]):
        boat.build(tmp_path / str(number))
        command = case(tmp_path / str(number))[0]
        assert command in ("check", "compare", "diagnose", "identify", "init", "simulate"), name


def test_the_picture_shows_what_came_of_each_part(tmp_path: Path) -> None:
    parts.draw([fuzz.Tally("a", 10, 3, 1.0, 0.5), fuzz.Tally("nothing", 0)], tmp_path / "attack.png")
    assert (tmp_path / "attack.png").stat().st_size > 1000
    figure = outcomes.picture(["a", "b"], {"read": [7, 0], "refused": [3, 4], "gave way": [0, 1]}, "Title")
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    assert widths == [70.0, 0.0, 30.0, 80.0, 0.0, 20.0]
    assert {"a (10)", "b (5)"} == {label.get_text() for label in figure.axes[0].get_yticklabels()}


def test_the_table_counts() -> None:
    text = parts.table([fuzz.Tally("a", 10, 3, 1.0, 0.5), fuzz.Tally("b", 5, 1, 2.0, 0.1, ["x: y"], 1)])
    assert "| a | 10 | 3 | 1 | 0.50 | nothing |" in text
    assert "| **together** | **15** | 4 | 3 | | **1** |" in text

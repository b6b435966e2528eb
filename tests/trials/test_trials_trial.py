"""A trial and a set of them: what they refuse, what is taken out of them, how they are shown."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.trials import Trial, Trials


def trial(name: str = "run") -> Trial:
    t = np.arange(5.0)
    return Trial(name, t, {"delta": 0.1 * t}, {"r": t**2}, lines=np.arange(2, 7), synthetic=True)


def test_channels_are_as_long_as_time() -> None:
    with pytest.raises(BadInput, match=r"trial 'run': channel 'r' has shape \(2,\), time has \(3,\)"):
        Trial("run", [0.0, 1.0, 2.0], {}, {"r": [0.0, 1.0]})


def test_a_channel_by_its_name() -> None:
    assert trial().channel("delta").tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    with pytest.raises(BadInput, match=r"no channel 'delt'. Did you mean 'delta'\?"):
        trial().channel("delt")


def test_samples_keep_their_lines() -> None:
    cut = trial().section(1, 4, "middle")
    assert (cut.name, cut.t.tolist(), cut.outputs["r"].tolist()) == ("middle", [1.0, 2.0, 3.0], [1.0, 4.0, 9.0])
    assert cut.lines is not None
    assert cut.lines.tolist() == [3, 4, 5]
    chosen = trial().samples(np.array([0, 3]))
    assert (chosen.name, chosen.inputs["delta"].tolist()) == ("run", pytest.approx([0.0, 0.3]))
    assert chosen.lines is not None
    assert chosen.lines.tolist() == [2, 5]
    assert chosen.duration == 3.0


def test_a_set_of_trials_by_name_and_without_some() -> None:
    runs = Trials([trial("a"), trial("b"), trial("c")])
    assert runs.only(["c", "a"]).names == ("c", "a")
    assert runs.without(["b"]).names == ("a", "c")
    for wrong in (runs.only, runs.without):
        with pytest.raises(BadInput, match=r"no trial 'bb'. Did you mean 'b'\?"):
            wrong(["bb"])
    with pytest.raises(BadInput, match=r"two trials are called .a.\. Give each trial its own name"):
        Trials([trial("a"), trial("b"), trial("a")])


def test_a_notebook_says_how_long_it_is_and_that_nobody_sailed_it() -> None:
    page = trial()._repr_html_()
    assert "<b>run</b>: 5 samples, 4.0 s (synthetic)" in page
    assert "<td>16</td>" in page  # the highest r

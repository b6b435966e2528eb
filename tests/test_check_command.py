"""`seatruth check`: what it says of the standard errors that the trials allow."""

from __future__ import annotations

from pathlib import Path

import pytest
from nomoto_ship import call, write_ship


@pytest.mark.parametrize(
    ("noise", "said"),
    [
        ({}, "at the start values and the noise that their misfit shows:"),
        ({"r": "0.1 deg/s"}, "and the stated noise, else the noise that their misfit shows:"),
        ({"r": "0.1 deg/s", "psi": "0.5 deg"}, "at the start values and the stated noise:"),
    ],
)
def test_the_preview_says_at_which_noise_its_errors_hold(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    noise: dict[str, str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    write_ship(tmp_path)
    assert call("init", "zigzag.csv", "--model", "ship.py:Nomoto") == 0
    study = tmp_path / "zigzag.toml"
    lines = "".join(f'{name} = "{value}"\n' for name, value in noise.items())
    study.write_text(study.read_text().replace("[noise]\n", f"[noise]\n{lines}"))
    assert call("check", "zigzag.toml") in (0, 1)
    shown = " ".join(capsys.readouterr().out.split())
    assert said in shown
    assert "A best std. error is a bound" in shown

"""The seal: a diagnosing process cannot read what is sealed, verdicts cannot change after they are hashed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "experiments"))

from withheld import score as score_module  # noqa: E402
from withheld.diagnose import diagnose, walls  # noqa: E402
from withheld.generate import generate  # noqa: E402
from withheld.score import said, score  # noqa: E402
from withheld.seal import digest_file, log, note  # noqa: E402
from withheld.verdicts import verdict as verdict_of  # noqa: E402

from seatruth.errors import BadInput  # noqa: E402

ANEMOMETER = ROOT.parent / "shared" / "data" / "esso_osaka" / "anemometer"
PEEK = """
import sys
sys.path[0] = {experiments!r}
from pathlib import Path
from withheld.blind import refuse
refuse([Path({folder!r})])
for ask in (lambda p: open(p), lambda p: p.read_bytes(), lambda p: list(p.parent.iterdir()),
            lambda p: open(f"{{p.parent}}/../{{p.parent.name}}/{{p.name}}")):
    try:
        ask(Path({file!r}))
    except PermissionError:
        continue
    sys.exit("read")
"""


def _set(out: Path) -> None:
    """A set of one case, truth and study made by hand."""
    case = out / "public" / "c001"
    case.mkdir(parents=True)
    (out / "sealed").mkdir()
    (case / "study.toml").write_text('[model]\nuse = "diving_plane"\n')
    truth = {
        "case": "c001", "family": "auv", "kind": "single", "effects": ["trim"], "lambda": {"trim": 150.0},
        "stratum": "100-400", "set": ["trim"], "places": ["pitch"], "oracle": None, "pairs": {}, "causes": [],
        "form": None, "stated": True,
    }  # fmt: skip
    (out / "sealed" / "c001.json").write_text(json.dumps(truth))
    (out / "sealed" / "_set.json").write_text(json.dumps({"set": "dev", "cases": 1, "seed": 0}))
    seal = {"c001": digest_file(out / "sealed" / "c001.json")}
    (out / "public" / "seal.json").write_text(json.dumps({"set": "dev", "sealed": seal}))
    note(out, "generate", "end", {})


@pytest.mark.parametrize("link", [False, True])
def test_the_hook_alone_keeps_a_folder_shut(tmp_path: Path, link: bool) -> None:
    folder = tmp_path / "sealed"
    folder.mkdir()
    (folder / "c001.json").write_text("{}")
    file = folder / "c001.json"
    if link:
        (tmp_path / "door").symlink_to(folder)
        file = tmp_path / "door" / "c001.json"
    code = PEEK.format(experiments=str(ROOT / "experiments"), folder=str(folder), file=str(file))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_walls_empty_the_folder_for_the_process_only(tmp_path: Path) -> None:
    folder = tmp_path / "sealed"
    folder.mkdir()
    (folder / "c001.json").write_text("{}")
    prefix = walls([folder])
    if not prefix:
        pytest.skip("this system has no mount namespaces for users")
    done = subprocess.run([*prefix, "ls", str(folder)], capture_output=True, text=True, check=True)
    assert done.stdout == ""
    assert (folder / "c001.json").exists()


@pytest.mark.skipif(not ANEMOMETER.is_dir(), reason="the real trials (../shared/data) are not on this machine")
def test_the_anemometer_is_out_of_reach_of_a_diagnosing_process() -> None:
    file = sorted(ANEMOMETER.glob("*.csv"))[0]
    code = PEEK.format(experiments=str(ROOT / "experiments"), folder=str(ANEMOMETER), file=str(file))
    done = subprocess.run(
        [*walls([ANEMOMETER]), sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_of_a_set_diagnosed_in_part_all_are_asked_about_that_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def knows(truth: dict[str, Any], public: Path) -> dict[str, Any]:
        asked.append(truth["case"])
        return verdict_of(truth["case"], [(["trim"], 0.9)])

    monkeypatch.setattr(score_module, "limit", knows)
    _set(tmp_path)
    more = json.loads((tmp_path / "sealed" / "c001.json").read_text()) | {"case": "c002"}
    (tmp_path / "sealed" / "c002.json").write_text(json.dumps(more))
    seal = {name: digest_file(tmp_path / "sealed" / f"{name}.json") for name in ("c001", "c002")}
    (tmp_path / "public" / "seal.json").write_text(json.dumps({"set": "dev", "sealed": seal}))
    diagnose(tmp_path, "prior", 1, skip=1)
    pairs = score(tmp_path)
    assert asked == ["c002"]
    assert {name: len(of) for name, of in pairs.items()} == {"prior": 1, "limit": 1, "oracle": 1}
    content = json.loads((tmp_path / "score.json").read_text())
    assert (len(content["cases"]), content["sealed"]) == (1, 2)


def test_steps_in_order_and_hashes_that_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(score_module, "limit", lambda truth, public: verdict_of(truth["case"], [(["trim"], 0.9)]))
    _set(tmp_path)
    with pytest.raises(BadInput, match="nothing was diagnosed"):
        score(tmp_path)
    diagnose(tmp_path, "prior", 1)
    assert [line["step"] for line in log(tmp_path)] == ["generate", "diagnose", "diagnose"]
    pairs = score(tmp_path)
    assert set(pairs) == {"prior", "limit", "oracle"}
    assert json.loads((tmp_path / "score.json").read_text())["synthetic"] is True

    verdict = tmp_path / "verdicts" / "prior" / "c001.json"
    kept = verdict.read_text()
    verdict.write_text(kept.replace("underpowered", "no_gap", 1))
    with pytest.raises(BadInput, match="changed after"):
        said(tmp_path, "prior")
    verdict.write_text(kept)
    sealed = tmp_path / "sealed" / "c001.json"
    sealed.write_text(sealed.read_text().replace("trim", "munk", 1))
    with pytest.raises(BadInput, match="seal of c001 is broken"):
        score(tmp_path)
    lines = (tmp_path / "log.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "log.jsonl").write_bytes(b"".join(lines[:1] + lines[2:]))
    with pytest.raises(ValueError, match="log was changed"):
        log(tmp_path)


def test_a_set_without_a_case_is_not_sealed(tmp_path: Path) -> None:
    """`--as-is` seals what was made: where nothing was, a set of no cases would have been diagnosed and scored."""
    with pytest.raises(BadInput, match="no case is there to seal"):
        generate("dev", tmp_path, 2, 1, False, 1, as_is=True)
    assert not (tmp_path / "public" / "seal.json").exists()

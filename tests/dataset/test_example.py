"""The question of the page, error against bank angle, has the answer that was put into the flights."""

import re

import numpy as np
import pytest

from magsim.recording import Recording, write_recordings
from tests.support.folders import write_index_of
from tests.support.paths import ROOT

BANKS = (10.0, 20.0, 30.0)


def banked(name: str, bank_deg: float) -> Recording:
    """A flight whose interference in band grows with the bank: 0.1 nT a degree at 0.3 Hz, in training and test."""
    time_s = np.arange(4000) * 0.1
    wave = np.sin(2.0 * np.pi * 0.3 * time_s)
    direction = np.array([0.6, 0.0, 0.8])[:, None] + 0.12 * np.array([wave, np.cos(0.2 * time_s), -wave])
    data = {f"flux_a_{axis}_nt": 50_000.0 * part for axis, part in zip("xyz", direction, strict=True)}
    interference = 0.1 * bank_deg * wave
    data |= {"interference_a_nt": interference, "clean_a_nt": np.full(4000, 50_000.0)}
    data |= {"mag_a_nt": 50_000.0 + interference, "split": np.repeat([0.0, 2.0], 2000)}
    return Recording(name, time_s, data)


def test_error_against_bank_angle(tmp_path, monkeypatch):
    folder = tmp_path / "data" / "banks"
    folder.mkdir(parents=True)
    bank = {f"f{number:07d}": BANKS[number % 3] for number in range(6)}
    for number in range(2):
        flights = [banked(name, bank[name]) for name in list(bank)[3 * number : 3 * number + 3]]
        write_recordings(folder / f"shard_{number:06d}.h5", flights)
    write_index_of(folder, {"pattern.bank_deg": "double"}, lambda name: {"pattern.bank_deg": bank[name]}, failed=1)
    text = (ROOT / "docs" / "streaming.md").read_text(encoding="utf-8")
    (code,) = (block for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL) if "bank_deg" in block)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(code, names)
    error_nt = names["error_nt"]
    assert error_nt.index.tolist() == list(BANKS)
    assert error_nt["none"].tolist() == pytest.approx([0.1 * value / np.sqrt(2.0) for value in BANKS], rel=0.01)
    assert (error_nt["tl16"] < 0.2 * error_nt["none"]).all()

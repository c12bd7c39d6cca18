"""A point under a rope beside MoorDyn: other equations, another code, a rope that stretches by 0.2 %."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.moored import STEP_HZ, towed
from tests.support.ropes import AIR, continuous_trail, point_chain
from tests.support.tows import at_rest, body_of, started, states


@pytest.mark.parametrize(("speed_mps", "mass_kg"), [(25.0, 20.0), (70.0, 80.0)])
def test_a_tow_that_starts_and_sways_flies_as_in_moordyn(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    speed_mps: float,
    mass_kg: float,
) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    chain, seconds = point_chain(mass_kg), 70.0
    place, drive = started(speed_mps, 30.0, sway_m=0.5, sway_s=7.0)
    time, rows, _ = states(chain, at_rest(chain, 1e-6), drive, seconds=seconds, step_hz=STEP_HZ, log_hz=STEP_HZ)
    ours, other = body_of(chain, rows)[0], towed(tmp_path, chain, AIR, place(time))
    assert capfd.readouterr() == ("", "")
    assert not list(Path().iterdir())
    trails = [np.degrees(np.arctan2(-one[:, 0], one[:, 2])) for one in (ours, other)]
    # all the way, and where it settles
    assert np.abs(trails[0] - trails[1]).max() < 0.1
    last = round(11.0 * STEP_HZ)
    exact = np.degrees(continuous_trail(chain.rope, mass_kg, 0.06, speed_mps))
    assert trails[1][-last:].mean() == pytest.approx(exact, abs=0.1)
    assert trails[0][-last:].mean() == pytest.approx(trails[1][-last:].mean(), abs=0.1)
    sides = [np.degrees(np.arctan2(one[:, 1], one[:, 2])) for one in (ours, other)]
    assert np.ptp(sides[1]) > 5.0
    assert np.abs(sides[0] - sides[1]).max() < 0.02 * np.ptp(sides[1])

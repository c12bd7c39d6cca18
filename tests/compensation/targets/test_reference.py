"""Another magnetometer as target: raw, or compensated by a method of its own."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import create
from magsim.compensation.targets import OtherReading
from magsim.errors import RequestError
from tests.support.birds import COEFFICIENTS, terms
from tests.support.surveys import survey

PART = 0.02
"""Interference of the stinger as a part of the cabin's."""


@pytest.fixture(scope="module")
def both():
    """Cabin and stinger over the same geology, the stinger with a fiftieth of the interference, and a dropout."""
    r = survey()
    own = PART * terms(r) @ COEFFICIENTS
    stinger = r["clean_cabin_nt"] + 1.5 + own
    valid = np.ones(len(r))
    valid[3000:3050] = 0.0
    stinger = np.where(valid == 1.0, stinger, 0.0)
    labels = {"interference_stinger_nt": own, "mag_stinger_nt": stinger, "mag_stinger_valid": valid}
    return replace(r, data={**r.data, **labels})


def left(method, recording):
    return recording["interference_cabin_nt"] - method.interference(recording)


def test_what_the_reference_keeps_is_missing_of_the_estimate(both):
    bare = replace(both, data={n: v for n, v in both.data.items() if not n.startswith("interference")})
    raw = create("tl16", target="reference", reference="stinger", band="broad").fit(bare, sensor="cabin")
    # the estimate lacks the interference of the reference, and its constant the difference of the two fields; central
    # differences are one-sided at the edges of the dropout
    np.testing.assert_allclose(left(raw, both), both["interference_stinger_nt"] + 1.5, rtol=0, atol=5e-3)
    # over the same geology the reading by itself is no target at all
    assert np.std(left(create("tl16", target="measured").fit(bare, sensor="cabin"), both)) > 0.3


def test_a_compensated_reference_leaves_nothing(both, tmp_path):
    create("tl16").fit(both, sensor="stinger").save(tmp_path / "stinger")
    settings = {"target": "reference", "reference": "stinger", "reference_model": str(tmp_path / "stinger")}
    for band in ("in", "broad"):
        method = create("tl16", band=band, **settings).fit(both, sensor="cabin")
        assert np.std(left(method, both)) < 1e-3
    assert method.requires == ("flux_{sensor}_{axis}_nt",)


def test_rows_count_in_which_both_read(both):
    known = OtherReading("stinger").known(both, "cabin")
    assert np.flatnonzero(~known).tolist() == list(range(3000, 3050))


class Warm(type(create("none"))):
    warmup_s = 5.0


def test_references_that_cannot_serve_are_refused(both, tmp_path):
    none = create("none").fit(both, sensor="cabin")
    none.save(tmp_path / "cabin")
    for settings, text in (
        (
            {"reference": "wing"},
            "'survey0' has no column mag_wing_nt, which method tl16 reads while it",
        ),
        ({"reference": "cabin"}, "target 'reference': 'cabin' is the magnetometer to be compensated; allowed: another"),
        (
            {"reference": "stinger", "reference_model": str(tmp_path / "cabin")},
            "reference_model was fitted for magnetometer 'cabin'; allowed: one for 'stinger'",
        ),
        ({"reference": "stinger", "reference_model": str(tmp_path)}, "holds no fitted method"),
    ):
        with pytest.raises(RequestError, match=text):
            create("tl16", target="reference", **settings).fit(both, sensor="cabin")
    with pytest.raises(RequestError, match=r"estimates nothing in the first 5 s of each piece; allowed: a method with"):
        OtherReading("cabin", Warm().fit(both, sensor="cabin")).check()

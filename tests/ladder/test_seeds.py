"""Hidden seeds are those that anybody can compute again."""

import hashlib

import pytest

from magsim.errors import RequestError
from magsim.ladder.seeds import hidden_seed


def test_a_hidden_seed_is_the_digest_of_archive_and_randomness(tmp_path):
    archive, pulse = tmp_path / "method.zip", "4F1C" * 32
    archive.write_bytes(b"method")
    whole = hashlib.sha256(hashlib.sha256(b"method").digest() + pulse.encode()).hexdigest()
    assert hidden_seed(archive, f" {pulse}\n") == int(whole[:16], 16) // 2
    archive.write_bytes(b"methods")
    assert hidden_seed(archive, pulse) != int(whole[:16], 16) // 2


def test_what_can_be_guessed_is_refused(tmp_path):
    (tmp_path / "method.zip").write_bytes(b"method")
    with pytest.raises(RequestError, match="has 3 characters; allowed: 16 or more"):
        hidden_seed(tmp_path / "method.zip", "abc")
    with pytest.raises(RequestError, match=r"no\.zip"):
        hidden_seed(tmp_path / "no.zip", "4F1C" * 32)

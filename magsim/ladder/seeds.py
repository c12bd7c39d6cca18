"""Seeds of a ladder: the public one, and hidden ones that nobody can have known when a method was handed in.

Whoever knows a seed can fly its sets. So rankings that are published come from a hidden seed: the SHA-256 of the
method's archive and of public randomness that is dated after it (a beacon's pulse, a lottery's numbers, a block's
hash). Anybody can compute it again, and nobody could before.
"""

import hashlib
from pathlib import Path

from magsim.errors import RequestError
from magsim.files import first_bytes

PUBLIC_SEED = 20_261_201
"""Of the sets that everybody may look at."""

MAX_ARCHIVE = 2**30


def hidden_seed(archive: Path, randomness: str) -> int:
    """Return the seed of a submission, 0 to 2^63 - 1.

    Parameters
    ----------
    archive : Path
        The submitted file, byte for byte.
    randomness : str
        The public text, as it was published, without blanks around it.

    Raises
    ------
    RequestError
        If there is no such file, or no randomness.
    """
    text = randomness.strip()
    if len(text) < 16:
        msg = f"public randomness {text!r} has {len(text)} characters; allowed: 16 or more, so that nobody can try all"
        raise RequestError(msg)
    digest = hashlib.sha256(hashlib.sha256(first_bytes(archive, MAX_ARCHIVE, kind="an archive")).digest())
    digest.update(text.encode("utf-8"))
    return int.from_bytes(digest.digest()[:8], "big") >> 1

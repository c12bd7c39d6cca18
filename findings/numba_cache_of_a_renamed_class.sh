#!/usr/bin/env bash
# Numba's cache on disk, when the class of an argument gets another name.
#
# Guess:  numba.njit(cache=True) notices that the source file has changed and compiles anew.
# Truth:  where an argument is a NamedTuple of the same file and that class was renamed (in the file and by all who use it),
#         the first call ends in "AttributeError: Can't get attribute 'Line'". The index of the cache is unpickled before
#         its stamp of the source is compared, and it refers to the class by its old name. Deleting the *.nbi files helps;
#         pip leaves them behind when a package is upgraded.
# Seen:   numba 0.68.1 with llvmlite 0.50.0, numpy 2.4, Python 3.11.
#
# Ends with 0 if this is still so, else with 1. Needs Python with venv and a package index.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/python -m pip install --quiet --disable-pip-version-check numba==0.68.1 "numpy<2.5"

cat > body.py <<'PY'
from typing import NamedTuple

import numba


class Line(NamedTuple):
    length: float


@numba.njit(cache=True)
def twice(line):
    return 2.0 * line.length
PY
echo 'import body; print("result:", body.twice(body.Line(1.5)))' > use.py
venv/bin/python use.py

sed 's/Line/Rope/' body.py > renamed.py && mv renamed.py body.py
sed 's/Line/Rope/' use.py > renamed.py && mv renamed.py use.py
if venv/bin/python use.py > after.txt 2>&1; then
    echo "CHANGED: the renamed class is compiled anew: $(cat after.txt)"
    exit 1
fi
echo "after:  $(tail -n 1 after.txt)"
grep -q "AttributeError: Can't get attribute 'Line'" after.txt || { echo "CHANGED: another error"; exit 1; }

rm -f __pycache__/*.nbi
venv/bin/python use.py
venv/bin/python -c 'import numba, llvmlite, numpy; print("numba", numba.__version__, "llvmlite", llvmlite.__version__, "numpy", numpy.__version__)'

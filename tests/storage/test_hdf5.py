"""HDF5 files from elsewhere are read only where they are plain and bounded."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from magsim.errors import DataError, RequestError
from magsim.storage import hdf5, inspection


def make_file(path: Path, **datasets: object) -> Path:
    with h5py.File(path, "w") as file:
        for name, value in datasets.items():
            file[name] = value
    return path


def refused(path: Path, read: object) -> str:
    with pytest.raises(DataError) as caught, hdf5.open_untrusted(path) as root:
        read(root)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert "\n" not in text
    return text


def test_plain_values_are_read(tmp_path):
    path = make_file(tmp_path / "a.h5", x=np.arange(6.0).reshape(2, 3))
    hdf5.add_checksum(path)
    with hdf5.open_untrusted(path) as root:
        assert root.names() == ["x"]
        assert root.array("x", kind="f", ndim=2).tolist() == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]


def test_links_out_of_the_file_are_refused(tmp_path):
    secret = make_file(tmp_path / "secret.h5", x=np.ones(3))
    for number, link in enumerate([h5py.ExternalLink(str(secret), "x"), h5py.SoftLink("/y")]):
        path = make_file(tmp_path / f"{number}.h5", y=np.ones(3))
        with h5py.File(path, "a") as file:
            file["x"] = link
        assert "link to elsewhere" in refused(path, lambda root: root.array("x", kind="f", ndim=1))


def test_values_kept_in_other_files_are_refused(tmp_path):
    (tmp_path / "secret.txt").write_bytes(b"12345678" * 4)
    path = tmp_path / "external.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", shape=(4,), dtype="f8", external=[(str(tmp_path / "secret.txt"), 0, 32)])
        layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
        layout[:] = h5py.VirtualSource(str(make_file(tmp_path / "s.h5", v=np.ones(3))), "v", shape=(3,))
        file.create_virtual_dataset("v", layout)
    for name in ("x", "v"):
        assert "in another file" in refused(path, lambda root, name=name: root.array(name, kind="f", ndim=1))


def test_a_small_file_that_claims_terabytes_is_refused(tmp_path):
    path = tmp_path / "bomb.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", shape=(2**40,), dtype="f8", chunks=(2**20,))
    assert "claims 8796093022208 bytes" in refused(path, lambda root: root.array("x", kind="f", ndim=1))


def test_only_filters_of_hdf5_itself_are_allowed(tmp_path):
    path = tmp_path / "f.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("good", data=np.arange(100.0), compression="gzip", shuffle=True)
    with hdf5.open_untrusted(path) as root:
        assert root.array("good", kind="f", ndim=1)[99] == 99.0
    with h5py.File(path, "a") as file:
        file.create_dataset("bad", data=np.arange(100.0), compression="lzf")
    assert "packed with filter" in refused(path, lambda root: root.array("bad", kind="f", ndim=1))


def test_odd_names_and_types_are_refused(tmp_path):
    path = make_file(tmp_path / "n.h5", **{"Bad name": np.ones(2), "i": np.arange(3)})
    assert "the name 'Bad name' is not allowed" in refused(path, lambda root: root.names())
    assert "expected 1 of kind 'f'" in refused(path, lambda root: root.array("i", kind="f", ndim=1))
    assert "there is no z" in refused(path, lambda root: root.array("z", kind="f", ndim=1))
    assert "i is not a group" in refused(path, lambda root: root.group("i"))


def test_files_that_are_not_hdf5_are_refused(tmp_path):
    path = tmp_path / "x.h5"
    path.write_bytes(b"")
    assert "is empty" in refused(path, lambda _: None)
    path.write_text("hello, this is text")
    assert "is not an HDF5 file" in refused(path, lambda _: None)
    with pytest.raises(RequestError, match="there is no such file"), hdf5.open_untrusted(tmp_path / "no.h5"):
        pass
    with pytest.raises(RequestError, match="is a folder"), hdf5.open_untrusted(tmp_path):
        pass


def test_a_checksum_that_does_not_fit_is_reported(tmp_path):
    path = make_file(tmp_path / "s.h5", x=np.zeros(1000))
    hdf5.add_checksum(path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert "bytes are not those that were written" in refused(path, lambda _: None)


def test_an_inspector_that_crashes_or_hangs_does_not_take_the_caller_along(tmp_path, monkeypatch):
    path = make_file(tmp_path / "x.h5", x=np.ones(3))
    program = tmp_path / "inspector.py"
    monkeypatch.setattr(inspection, "INSPECTOR", program)
    program.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    assert "breaks down" in refused(path, lambda _: None)
    program.write_text("import time; time.sleep(60)")
    monkeypatch.setattr(inspection, "TIMEOUT_S", 0.3)
    path = make_file(tmp_path / "x.h5", y=np.ones(3))
    assert "does not come to an end" in refused(path, lambda _: None)

"""Harmful recording files: each is a sound recording with one malicious change."""

import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from magsim.recording import Recording
from magsim.storage import hdf5
from magsim.storage.checksum import CHECKSUM_BYTES

CANARY = 31_415.926535
"""Value that fills the secret files: no reader may ever return it."""


def recording(number: int = 0) -> Recording:
    """Return a small sound recording; other numbers give other sizes and values."""
    rng = np.random.default_rng(number)
    rows = 40 + 7 * (number % 11)
    data = {
        "mag_cabin_nt": 45_000.0 + rng.normal(size=rows),
        "ins_roll_deg": rng.normal(size=rows),
        "interference_cabin_nt": rng.normal(size=rows),
        **{f"permanent_cabin_{axis}_nt": rng.normal(size=rows) for axis in "xyz"},
        "circuit": np.ones(rows),
    }
    meta = {"seed": number, "start_utc": "2025-03-13T02:00:00+00:00", "maneuvers": [{"axis": "pitch"}]}
    return Recording(f"flight_{number}", np.arange(rows) * 0.1, data, meta)


def secrets_of(folder: Path) -> tuple[Path, Path]:
    """Write a raw and an HDF5 file that no reader of another file may open."""
    folder.mkdir(exist_ok=True)
    raw, other = folder / "secret.bin", folder / "secret.h5"
    np.full(1000, CANARY).tofile(raw)
    with h5py.File(other, "w") as file:
        file["v"] = np.full((40, 2), CANARY)
    return raw, other


def _swap(group: h5py.Group, name: str, make: Callable[[h5py.Group], object]) -> None:
    """Replace a data set, and keep its attributes if possible."""
    attributes = {key: value for key, value in group[name].attrs.items() if key.startswith("column_")}
    del group[name]
    make(group)
    if isinstance(group.get(name, getlink=True), h5py.HardLink):
        group[name].attrs.update(attributes)


def _virtual(group: h5py.Group, other: Path) -> None:
    layout = h5py.VirtualLayout(shape=(40, 2), dtype="f8")
    layout[:] = h5py.VirtualSource(str(other), "v", shape=(40, 2))
    group.create_virtual_dataset("input", layout)


def _deep(group: h5py.Group, depth: int) -> None:
    for _ in range(depth):
        group = group.create_group("g")


def _unknown_filter(group: h5py.Group) -> None:
    """Use a filter for which HDF5 would load a plugin."""
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_chunk((40, 2))
    properties.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, (3,))
    space = h5py.h5s.create_simple((40, 2))
    h5py.h5d.create(group.id, b"input", h5py.h5t.IEEE_F64LE, space, properties)


def _many_links(group: h5py.Group) -> None:
    group.create_dataset("big", shape=(12_000_000,), dtype="f8", chunks=(1_000_000,), compression="gzip", fillvalue=1.0)
    for number in range(200):
        group[f"l{number}"] = group["big"]


def crafted(folder: Path) -> dict[str, Path]:
    """Write all of them, each with a checksum that fits; every one must be refused.

    Returns
    -------
    dict of str to Path
        By the name of the change.
    """
    raw, other = secrets_of(folder / "secrets")
    plain: dict[str, Callable[[h5py.File, h5py.Group], object]] = {
        "external_link": lambda f, g: _swap(g, "input", lambda g: g.update(input=h5py.ExternalLink(str(other), "v"))),
        "external_link_to_system": lambda f, g: f.update(x=h5py.ExternalLink("/etc/passwd", "/")),
        "external_flight": lambda f, g: f["flights"].update({"000002": h5py.ExternalLink(str(other), "/")}),
        "soft_link": lambda f, g: g.move("input", "other") or g.update(input=h5py.SoftLink("other")),
        "external_storage": lambda f, g: _swap(
            g, "input", lambda g: g.create_dataset("input", (40, 2), "f8", external=[(str(raw), 0, 640)])
        ),
        "external_storage_beside": lambda f, g: f.create_dataset("x", (9,), "f8", external=[(str(raw), 0, 72)]),
        "virtual": lambda f, g: _swap(g, "input", lambda g: _virtual(g, other)),
        "terabytes_packed": lambda f, g: _swap(
            g, "input", lambda g: g.create_dataset("input", (2**39, 2), "f8", chunks=(2**16, 2), compression="gzip")
        ),
        "terabytes_plain": lambda f, g: _swap(g, "input", lambda g: g.create_dataset("input", (2**39, 2), "f8")),
        "terabytes_of_text": lambda f, g: _swap(
            g, "input_channel", lambda g: g.create_dataset("input_channel", (2**40,), "S8")
        ),
        "many_links_to_one": lambda f, g: _many_links(f.create_group("x")),
        "deep": lambda f, g: _deep(f, 3000),
        "cycle": lambda f, g: g.create_group("x").update({"up": f["flights"]}),
        "filter_of_a_plugin": lambda f, g: _swap(g, "input", _unknown_filter),
        "name_of_control_characters": lambda f, g: g.create_group("\x1b[2Jinput"),
        "name_of_dots": lambda f, g: f["flights"].create_group(".. "),
        "name_in_unicode": lambda f, g: g.create_group("ínput"),
        "name_of_python": lambda f, g: f["flights"].copy("000001", "__class__.A"),
        "name_of_60000": lambda f, g: g.create_group("a" * 60_000),
        "name_with_a_break": lambda f, g: g.create_group("input\nsound"),
        "column_of_another_kind": lambda f, g: g["input_channel"].__setitem__(0, b"../../x"),
        "compound": lambda f, g: _swap(g, "time_s", lambda g: g.update(time_s=np.zeros(40, dtype="f8,i4"))),
        "texts_of_any_length": lambda f, g: _swap(
            g, "input_channel", lambda g: g.create_dataset("input_channel", data=["a", "b"], dtype=h5py.string_dtype())
        ),
        "references": lambda f, g: _swap(
            g, "input", lambda g: g.create_dataset("input", data=[[f.ref] * 2] * 40, dtype=h5py.ref_dtype)
        ),
        "scalar": lambda f, g: _swap(g, "time_s", lambda g: g.update(time_s=1.0)),
        "empty": lambda f, g: _swap(g, "time_s", lambda g: g.update(time_s=h5py.Empty("f8"))),
        "no_rows": lambda f, g: _swap(g, "time_s", lambda g: g.update(time_s=np.zeros(0))),
        "not_a_number": lambda f, g: g["input"].__setitem__((3, 1), np.nan),
        "deep_json": lambda f, g: g.attrs.update(x_json=np.bytes_("[" * 50_000)),
        "long_number": lambda f, g: g.attrs.update(x_json=np.bytes_("9" * 50_000)),
        "version_of_text": lambda f, g: f.attrs.update(schema_version="2; rm"),
    }
    paths = {}
    for name, change in plain.items():
        path = folder / f"{name}.h5"
        recording().write(path)
        with h5py.File(path, "a") as file:
            change(file, file["flights/000001"])
        hdf5.add_checksum(path)
        paths[name] = path
    return paths


def mutate(data: bytes, rng: np.random.Generator) -> bytes:
    """Return a copy with 1 to 8 changed bytes, mostly structure; a third without, a third with a new checksum."""
    body = bytearray(data[:-CHECKSUM_BYTES])
    kind = int(rng.integers(3))
    structure = np.flatnonzero(np.frombuffer(bytes(body), np.uint8))
    for _ in range(int(rng.integers(1, 9))):
        anywhere = rng.random() < 0.3
        position = int(rng.integers(len(body))) if anywhere else int(rng.choice(structure))
        body[position] ^= int(rng.integers(1, 256))
    if kind == 0:
        return bytes(body) + data[-CHECKSUM_BYTES:]
    return bytes(body) if kind == 1 else with_checksum(bytes(body))


def with_checksum(body: bytes) -> bytes:
    """Return bytes with their checksum, which anyone can compute."""
    import hashlib

    return body + f"magsim-sha256:{hashlib.sha256(body).hexdigest()}\n".encode()


def digest_of(found: Recording) -> str:
    """Return name, metadata and bits of a recording as one text."""
    columns = {name: column.tobytes().hex() for name, column in found.data.items()}
    return json.dumps([found.name, found.time_s.tobytes().hex(), columns, found.meta], sort_keys=True)

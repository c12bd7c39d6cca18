"""``magsim compensate``: survey files and lines as they come; what is added, what stays, what is refused."""

import io
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pytest

from magsim import exchange
from magsim.compensation import create
from magsim.recording import Recording, write_recordings
from tests.support.commands import run
from tests.support.worlds import World, calibration

pytestmark = pytest.mark.usefixtures("own_folder")

MAP = """\
time = "UTC"
line = "LINE"
[columns]
mag_cabin_nt = "RAWMAG"
flux_cabin_x_nt = {column = "FLUX_X", scale = 1000.0}
flux_cabin_y_nt = {column = "FLUX_Y", scale = 1000.0}
flux_cabin_z_nt = {column = "FLUX_Z", scale = 1000.0}
"""
ADDED = ("compensated_cabin_nt", "removed_cabin_nt")
FLUX = [f"flux_cabin_{axis}_nt" for axis in "xyz"]
HALF_DIGIT = 0.51e-4
LINE_ROWS = 900
ROWS = 3 * LINE_ROWS
NULLS = (400, 401, 1950)


@pytest.fixture(scope="module")
def recording():
    return calibration(World(circuits=2))


@pytest.fixture(scope="module")
def tl16(recording):
    return create("tl16").fit(recording)


@pytest.fixture(scope="module")
def model(tl16, tmp_path_factory):
    folder = tmp_path_factory.mktemp("models") / "tl16"
    tl16.save(folder)
    return folder


@pytest.fixture(scope="module")
def fitted(model, tl16):
    """The folder of a method and the method."""
    return model, tl16


@pytest.fixture(scope="module")
def rows(recording):
    """The rows of the survey files: three lines, 201.1 to 201.3, with a gap in time before the last."""
    keep = np.arange(ROWS) + np.where(np.arange(ROWS) < 2 * LINE_ROWS, 0, 50)
    return recording.take(6400 + keep)


def numbers_of_lines(rows):
    return 201.0 + 0.1 * (1 + np.arange(len(rows)) // LINE_ROWS)


def survey_rows(rows):
    """Texts of a contractor's rows: fluxgate in microteslas, a column of words, some values missing."""
    lines = numbers_of_lines(rows)
    out = []
    for i in range(len(rows)):
        flux = [repr(float(rows[name][i]) / 1000.0) for name in FLUX]
        if i in NULLS:
            flux[1] = "*"
        time_s = f"{46_000.0 + rows.time_s[i]:.2f}"
        out.append([f"{lines[i]:.1f}", time_s, f" {i:05d}", repr(float(rows["mag_cabin_nt"][i])), *flux, "ok?"])
    return out


HEAD = "LINE,UTC,FID,RAWMAG,FLUX_X,FLUX_Y,FLUX_Z,REMARK"


@pytest.fixture
def survey(rows, tmp_path):
    path = tmp_path / "survey.csv"
    path.write_bytes("".join(",".join(row) + "\r\n" for row in [HEAD.split(","), *survey_rows(rows)]).encode())
    (tmp_path / "map.toml").write_text(MAP)
    return path


@pytest.fixture
def magsim(capsys):
    """A function that runs ``magsim compensate``: exit code, output, errors."""
    return lambda *args: run(capsys, "compensate", *args)


@pytest.fixture
def feed(capsys, monkeypatch):
    """The same with a text as standard input."""

    def through(content, *args):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))
        return run(capsys, "compensate", *args)

    return through


def appended(path, source, separator=b","):
    """The two numbers that are appended to each row, NaN for missing ones; all else must be as it was."""
    before, after = source.read_bytes().splitlines(keepends=True), path.read_bytes().splitlines(keepends=True)
    assert len(before) == len(after)
    out = []
    for old, new in zip(before[1:], after[1:], strict=True):
        body = old.rstrip(b"\r\n")
        assert new.startswith(body + separator)
        assert new.endswith(old[len(body) :])
        texts = new[len(body) + 1 :].strip(b"\r\n").split(separator if separator == b"," else None)
        out.append([float(text) if text not in (b"", b"*") else np.nan for text in texts])
    return np.array(out)


def check(found, method, rows, asked):
    """Compare with the rows that have all values, as a recording."""
    asked = asked.copy()
    asked[list(NULLS)] = False
    kept = rows.take(asked)
    assert np.isnan(found[~asked]).all()
    np.testing.assert_allclose(found[asked, 0], method.compensate(kept), rtol=0.0, atol=HALF_DIGIT)
    np.testing.assert_allclose(found[asked, 1], method.interference(kept), rtol=0.0, atol=HALF_DIGIT)


def test_a_table_keeps_every_byte_and_gets_two_columns(survey, fitted, rows, magsim):
    model, tl16 = fitted
    code, out, err = magsim(model, survey, "--map", "map.toml", "-o", "out.csv")
    assert (code, err) == (0, "")
    assert f"out.csv: {ROWS - len(NULLS)} of {ROWS} rows compensated, " in out
    path = Path("out.csv")
    assert path.read_bytes().splitlines()[0] == (HEAD + ",compensated_cabin_nt,removed_cabin_nt").encode()
    check(appended(path, survey), tl16, rows, np.ones(ROWS, dtype=bool))
    # the default name; an existing file stays
    assert magsim(model, survey, "--map", "map.toml")[0] == 0
    assert (Path("survey_compensated.csv")).read_bytes() == path.read_bytes()
    code, _, err = magsim(model, survey, "--map", "map.toml")
    assert code == 2
    assert "survey_compensated.csv" in err


def test_lines_are_picked_by_number(survey, fitted, rows, magsim):
    model, tl16 = fitted
    args = (model, survey, "--map", "map.toml", "--force", "-o", "out.csv")
    for text, picked in (("201.2", [1]), ("201.1,201.3", [0, 2]), ("201.15-201.9", [1, 2]), ("201.10-201.20", [0, 1])):
        assert magsim(*args, "--lines", text)[0] == 0
        found = appended(Path("out.csv"), survey)
        check(found, tl16, rows, np.isin(np.arange(ROWS) // LINE_ROWS, picked))


def test_lines_of_the_file_can_be_fitted_first(survey, rows, magsim):
    args = ("--map", "map.toml", "--calibrate", "201.1,201.2", "--lines", "201.3", "--save", "kept", "-o", "out.csv")
    code, _, err = magsim("tl16_gradient:order=0:vertical=false", survey, *args)
    assert (code, err) == (0, "")
    first = rows.take(np.setdiff1d(np.arange(2 * LINE_ROWS), NULLS))
    expected = create("tl16_gradient", order=0, vertical=False).fit(
        Recording("a", first.time_s, {n: first[n] for n in ("mag_cabin_nt", *FLUX)})
    )
    check(appended(Path("out.csv"), survey), expected, rows, np.arange(ROWS) >= 2 * LINE_ROWS)
    assert magsim("kept", survey, "--map", "map.toml", "--lines", "201.3", "-o", "two.csv")[0] == 0
    assert (Path("two.csv")).read_bytes() == (Path("out.csv")).read_bytes()


def test_standard_input_gives_what_the_file_gives(survey, fitted, rows, feed):
    model, tl16 = fitted
    args = (model, "-", "--map", "map.toml", "--lines", "201.1,201.3")
    code, _, err = feed(survey.read_bytes(), *args, "-o", "out.csv")
    assert (code, err) == (0, "")
    check(appended(Path("out.csv"), survey), tl16, rows, np.arange(ROWS) // LINE_ROWS != 1)
    code, out, _ = feed(survey.read_bytes(), *args)
    assert code == 0
    # capture translates the ends of lines
    assert out.splitlines() == (Path("out.csv")).read_text().splitlines()


def test_lines_come_out_one_by_one_until_the_end_or_a_broken_pipe(survey, model):
    command = [sys.executable, "-m", "magsim", "compensate", str(model), "-", "--map", "map.toml"]
    lines = survey.read_bytes().splitlines(keepends=True)[:40]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdin.write(lines[0] + lines[1])
        process.stdin.flush()
        assert process.stdout.readline().endswith(b",removed_cabin_nt\r\n")
        for before, line in pairwise(lines[1:]):
            process.stdin.write(line)
            process.stdin.flush()
            assert process.stdout.readline().startswith(before.rstrip())  # one row late
        process.stdin.close()
        assert process.stdout.read().startswith(lines[-1].rstrip())
        assert (process.wait(), process.stderr.read()) == (0, b"")
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        try:
            process.stdin.writelines(lines)
            process.stdin.close()
        except BrokenPipeError:
            pass
        assert (process.wait(), process.stderr.read()) == (1, b"")


def xyz(rows, *, repeated):
    head = "/ UTC FID RAWMAG FLUX_X FLUX_Y FLUX_Z\n"
    out, last = ["/ a survey\n", head, "/ ==== ===\n", "//Flight 7\n"], None
    for line, time_s, fid, *values, _ in survey_rows(rows):
        if line != last:
            out += [f"LINE {line}\n", *([head] if repeated and last else [])]
        last = line
        out.append(f"  {time_s} {fid}   {'  '.join(values)}\n")
    return "".join(out).encode()


@pytest.mark.parametrize("way", ["file", "standard input"])
def test_geosoft_lines_keep_their_comments_and_records(way, rows, fitted, magsim, feed):
    model, tl16 = fitted
    (Path("map.toml")).write_text(MAP.replace('line = "LINE"\n', ""))
    content = xyz(rows, repeated=True)
    (Path("in.xyz")).write_bytes(content)
    args = ("--map", "map.toml", "--format", "xyz", "-o", "out.xyz", "--lines", "201.1,201.3")
    if way == "file":
        code, _, err = magsim(model, "in.xyz", *args)
    else:
        code, _, err = feed(content, model, "-", *args)
    assert (code, err) == (0, "")
    before, after = content.splitlines(), (Path("out.xyz")).read_bytes().splitlines()
    numbers = []
    for old, new in zip(before, after, strict=True):
        if old.startswith(b"/ UTC"):
            assert new == old + b" compensated_cabin_nt removed_cabin_nt"
        elif old.startswith((b"/", b"LINE")):
            assert new == old
        else:
            assert new.startswith(old + b" ")
            numbers.append([np.nan if text == b"*" else float(text) for text in new[len(old) :].split()])
    check(np.array(numbers), tl16, rows, np.arange(ROWS) // LINE_ROWS != 1)


def test_a_recording_gets_two_columns(recording, model, tl16, magsim):
    parts = [recording.take(slice(0, 500)), recording.take(slice(2000, 2400))]
    flights = [Recording(f"flight {i}", part.time_s, part.data, part.meta) for i, part in enumerate(parts)]
    write_recordings("in.h5", flights)
    code, out, err = magsim(model, "in.h5")
    assert (code, err) == (0, "")
    assert "in_compensated.h5: 900 of 900 rows compensated" in out
    for flight in flights:
        back = Recording.read("in_compensated.h5", flight.name)
        np.testing.assert_allclose(back[ADDED[0]], tl16.compensate(flight), rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(back[ADDED[1]], tl16.interference(flight), rtol=0.0, atol=1e-9)
        kept = {name: values for name, values in back.data.items() if name not in ADDED}
        assert Recording(back.name, back.time_s, kept, back.meta) == flight


def test_rows_of_a_recording_that_are_not_asked_for_are_left_out(recording, model, magsim):
    recording.take(slice(0, 3000)).write("in.h5")
    code, _, err = magsim(model, "in.h5", "--lines", "102", "-o", "out.h5")
    assert code == 0
    picked = recording.take(slice(0, 3000)).where(leg=2)
    assert f"left out, having no estimate: {3000 - len(picked)} rows" in err
    np.testing.assert_array_equal(Recording.read("out.h5").time_s, picked.time_s)


def test_hdf5_in_the_layout_of_magnav_gets_two_fields(recording, magsim):
    """A network that looks ahead without limit will do for a file; its columns are those of the layout."""
    flight = recording.take(slice(0, 3200))
    source = exchange.export([(1, flight)], "mit", Path("in_mit.h5"), roles=["input", "segment"])[0]
    real = exchange.import_flight(source).recording
    method = create("tolles_lawson", derivative="spline", target="measured").fit(real)
    method.save("spline")
    code, _, err = magsim("spline", source, "--lines", "1.01", "-o", "out.h5")
    assert (code, err) == (0, "")
    with h5py.File(source) as before, h5py.File("out.h5") as after:
        assert set(after) == {*before, "compensated_m1_nt", "removed_m1_nt"}
        np.testing.assert_allclose(after["removed_m1_nt"][()], method.interference(real), rtol=0.0, atol=1e-9)
        np.testing.assert_array_equal(after["mag_1_uc"][()], before["mag_1_uc"][()])


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def csv_of(rows, **changes):
    """A table with columns of a recording; a change is a function of the values, or None for no such column."""
    names = ["mag_cabin_nt", *FLUX, "ins_roll_deg", "ins_pitch_deg", "ins_heading_deg"]
    data = {"time_s": rows.time_s, **{name: rows[name] for name in names}}
    data |= {name: change if change is None else change(data[name]) for name, change in changes.items()}
    kept = {name: values for name, values in data.items() if values is not None}
    lines = [",".join(kept), *(",".join(map(repr, row)) for row in np.column_stack([*kept.values()]).tolist())]
    return ("\n".join(lines) + "\n").encode()


WRONG = {
    "missing": ({FLUX[1]: None}, 2, r"there is no flux_cabin_y_nt, which .*; there is mag_cabin_nt, .*--map names"),
    "no reading": ({"mag_cabin_nt": None}, 2, r"there is no mag_cabin_nt"),
    "microteslas": (
        {name: lambda v: v / 1000.0 for name in FLUX},
        3,
        r"flux_cabin_x_nt to _z_nt .*microteslas \(scale = 1000",
    ),
    "volts": ({name: lambda v: v / 1e4 for name in FLUX}, 3, r"length of 4\.\d+ in the middle, .*volts or counts"),
    "gauss": ({"mag_cabin_nt": lambda v: v / 1e5}, 3, r"mag_cabin_nt reads 0\.4\d+ .*gauss \(scale = 100000\)"),
    "dead": ({FLUX[2]: lambda v: 0.0 * v + 17.0}, 3, r"flux_cabin_z_nt is 17 in all 2700 rows: the channel is dead"),
    "backward": ({"time_s": lambda v: np.where(v == v[500], v[400], v)}, 3, r"time does not increase strictly"),
}


@pytest.mark.parametrize("name", WRONG)
def test_channels_that_cannot_be_right_are_refused(name, rows, model, magsim, feed):
    changes, expected, message = WRONG[name]
    content = csv_of(rows, **changes)
    (Path("in.csv")).write_bytes(content)
    code, _, err = magsim(model, "in.csv", "-o", "out.csv")
    assert code == expected
    assert re.search(message, err), err
    assert names_in(Path()) == ["in.csv"]
    if name != "dead":  # of a feed it cannot be told from its first row
        code, _, err = feed(content, model, "-", "-o", "out.csv")
        assert code == expected
        assert re.search(message, err), err
        assert names_in(Path()) == ["in.csv"]


def test_attitude_in_radians_is_seen_where_it_is_read(recording, rows, magsim):
    method = create("bp", steps=2, folds=2, inputs=("tl16", "attitude")).fit(recording)
    method.save("bp")
    names = ("ins_roll_deg", "ins_pitch_deg", "ins_heading_deg")
    (Path("in.csv")).write_bytes(csv_of(rows, **dict.fromkeys(names, np.radians)))
    code, _, err = magsim("bp", "in.csv", "-o", "out.csv")
    assert code == 3
    assert "are they radians?" in err


BAD = [
    (("none", "survey.csv"), "none holds no fitted method"),
    (("MODEL", "other.csv"), "other.csv: there is no such file"),
    (("MODEL", "survey.txt"), "its ending is not that of a format"),
    (("MODEL", "survey.csv"), "has no time"),
    (("MODEL", "survey.csv", "--map", "map.toml", "--lines", "7-"), "'7-' is no line; allowed: numbers and ranges"),
    (("MODEL", "survey.csv", "--map", "map.toml", "--lines", "9-7"), "'9-7' is no line"),
    (("MODEL", "survey.csv", "--map", "map.toml", "--lines", "7"), "has no such line; it has 201.1, 201.2, 201.3"),
    (("MODEL", "survey.csv", "--map", "map.toml", "--save", "x"), "--save has no effect on a method that is fitted"),
    (("MODEL", "survey.csv", "--map", "map.toml", "--rate", "10"), "--rate has no effect on a file"),
    (("MODEL", "survey.csv", "--map", "map.toml", "-o", "survey.csv", "--force"), "is the file that is read"),
    (("MODEL", "-", "--calibrate", "7"), "--calibrate has no effect on standard input"),
    (("MODEL", "-", "--format", "mit"), "standard input is text; allowed: csv, xyz, sgl-xyz"),
    (("tl17", "survey.csv", "--map", "map.toml", "--calibrate", "201.1"), "unknown method 'tl17'"),
    (("tl16", "survey.csv", "--map", "map.toml", "--calibrate", "201.1"), "no label 'interference_cabin_nt'"),
]


@pytest.mark.parametrize(("args", "message"), BAD)
def test_requests_that_cannot_be_carried_out(args, message, survey, model, magsim):
    (Path("survey.txt")).write_bytes(b"1")
    before = names_in(Path())
    code, _, err = magsim(*(model if arg == "MODEL" else arg for arg in args))
    assert code == 2
    assert message in err
    assert names_in(Path()) == before


def test_what_is_compensated_already_is_refused(survey, model, magsim, feed):
    assert magsim(model, survey, "--map", "map.toml", "-o", "one.csv")[0] == 0
    for result in (
        magsim(model, "one.csv", "--map", "map.toml", "-o", "two.csv"),
        feed((Path("one.csv")).read_bytes(), model, "-", "--map", "map.toml"),
    ):
        assert result[0] == 2
        assert "has compensated_cabin_nt, removed_cabin_nt already" in result[2]
    assert not (Path("two.csv")).exists()


def test_too_few_rows_are_refused(survey, model, magsim, feed):
    survey.with_name("in.csv").write_text(",".join(["time_s", "mag_cabin_nt", *FLUX]) + "\n")
    code, _, err = magsim(model, "in.csv")
    assert code == 3
    assert "has no two rows in a row with values of" in err
    code, _, err = feed(b"", model, "-")
    assert code == 3
    assert "standard input: there is no line with the names of the columns" in err
    code, _, err = magsim("tl16_measured", survey, "--map", "map.toml", "--calibrate", "201.1")
    assert code == 3
    assert "training rows after 30 s at each end of each piece" in err


def test_a_broken_line_is_named_after_what_came_before_it(survey, model, magsim, feed):
    lines = survey.read_bytes().splitlines(keepends=True)[:30]
    code, out, err = feed(b"".join([*lines, b"1,2,3\r\n"]), model, "-", "--map", "map.toml")
    assert code == 3
    assert "standard input:31: there are 3 values; expected 8" in err
    assert len(out.splitlines()) == 30

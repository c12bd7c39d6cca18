"""``magsim benchmark --ladder``: what it is asked, refuses, prints and leaves."""

import json

import pytest

from magsim.cli.ladder import LadderOptions, settings_of
from magsim.ladder import judged
from magsim.ladder import run as running
from magsim.ladder.definition import read_ladder
from magsim.ladder.seeds import PUBLIC_SEED, hidden_seed
from magsim.recording import read_recordings
from tests.ladder.conftest import small
from tests.support.commands import run

NOTHING = LadderOptions(
    ladder=True, levels=None, track=None, sets=None, archive=None, randomness=None, jobs=1, resume=False, full=False,
    flights=False,
)  # fmt: skip


def asked(methods=None, *, seed=None, quick=False, **options):
    return settings_of(LadderOptions(**NOTHING.__dict__ | options), methods, seed=seed, quick=quick)


def test_a_quick_run_is_six_levels_twelve_sets_and_all_closed_forms():
    settings = asked(quick=True)
    assert settings.levels == read_ladder().quick
    assert (settings.sets, settings.tracks, settings.seed) == (12, ("no-labels", "open"), PUBLIC_SEED)
    names = {entry.name for entry in settings.methods}
    assert {"tl16", "tl16_measured", "exact_norm", "exact_norm_model", "vector_tl", "tl16_recursive"} <= names
    assert "none" not in names
    assert {entry.name for entry in settings.networks} == {"bp", "magtcn"}
    assert settings.task(3).networks
    assert not settings.task(4).networks
    assert settings.network_levels == read_ladder().networks


def test_a_full_run_is_everything():
    settings = asked(full=True)
    assert settings.levels == tuple(read_ladder().levels)
    assert len(settings.tracks) == 6
    assert settings.sets == 30
    assert not any(entry.quick for entry in settings.methods)


def test_methods_that_are_named_are_judged_everywhere_beside_tolles_lawson():
    settings = asked(["exact_norm", "none"], levels="L6,L0", track="open", sets=5, seed=9)
    assert [entry.name for entry in settings.methods] == ["tl16", "tl16_measured", "exact_norm"]
    assert (settings.levels, settings.sets, settings.seed, settings.networks) == (("L0", "L6"), 5, 9, ())


def test_a_hidden_seed_is_that_of_archive_and_randomness(tmp_path):
    archive = tmp_path / "method.zip"
    archive.write_bytes(b"method")
    pulse = "4F1C" * 8
    assert asked(archive=archive, randomness=pulse).seed == hidden_seed(archive, pulse)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--ladder", "--levels", "L5"], "there is no level 'L5'"),
        (["--ladder", "--track", "opne"], "there is no track 'opne' (did you mean 'open'?)"),
        (["--ladder", "--methods", "tl17"], "unknown method 'tl17'"),
        (["--ladder", "--quick", "--full"], "--quick and --full exclude each other"),
        (["--ladder", "--randomness", "0123456789abcdef"], "--archive and --randomness belong together"),
        (["--ladder", "flight.h5"], "--ladder flies its own recordings"),
        (["--levels", "L0"], "--levels is for the ladder; add --ladder"),
        (["--ladder", "--sets", "0"], "0 is not in the range"),
    ],
)
def test_what_does_not_fit_is_refused_before_a_flight(arguments, text, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, "benchmark", *arguments)
    assert code == 2
    assert out == ""
    assert text in err
    assert not [*tmp_path.iterdir()]


def test_a_run_leaves_its_board_and_prints_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for module in (judged, running):
        monkeypatch.setattr(module, "read_ladder", small)
    options = ["--ladder", "--levels", "L0", "--track", "open", "--sets", "1", "--seed", "3", "--methods", "tl16"]
    code, out, err = run(capsys, "benchmark", *options, "-o", "board")
    assert code == 0
    assert "L0, Tolles-Lawson's sources, exact norm: cabin, track open" in out
    assert "board: 1 sets on 1 levels and 1 tracks, 2 methods and 0 networks" in err
    assert "board/board.html has the whole" in err
    names = {
        "ladder.json",
        "sets",
        "scores.csv",
        "sets.csv",
        "standings.csv",
        "entered.csv",
        "report.json",
        "board.md",
        "board.html",
    }
    assert names <= {path.name for path in (tmp_path / "board").iterdir()}
    code, out, _ = run(capsys, "benchmark", *options, "-o", "board", "--resume", "--json")
    assert code == 0
    assert json.loads(out)["about"]["sets"] == 1
    code, _, err = run(capsys, "benchmark", *options, "-o", "board")
    assert code == 2
    assert "board holds files already: --resume goes on with a run of a ladder" in err


def test_flights_are_written_for_development(tmp_path, monkeypatch, capsys):
    from magsim.ladder import export

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(export, "read_ladder", small)
    options = ["--ladder", "--levels", "L0", "--sets", "1", "--flights"]
    code, out, _ = run(capsys, "benchmark", *options, "-o", "flights")
    assert (code, out) == (0, "flights/set_000_L0.h5\n")
    training, test = read_recordings(tmp_path / "flights" / "set_000_L0.h5")
    assert (training.name, test.name) == ("train_1_L0", "line_L0")
    code, out, _ = run(capsys, "benchmark", "flights/set_000_L0.h5", "--methods", "tl16,noise_floor", "-q")
    assert code == 0
    assert "noise_floor" in out

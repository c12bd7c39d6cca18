"""Commands that take a folder of recordings."""

from magsim.cli import main
from magsim.recording import write_recordings
from tests.support.worlds import World, calibration


def test_a_folder_is_trained_and_scored(tmp_path, monkeypatch, capsys):
    """A file that is being written is ignored."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "set").mkdir()
    write_recordings(tmp_path / "set" / "a.h5", [calibration(World(circuits=2))])
    (tmp_path / "set" / ".b.part.h5").write_text("being written")
    assert main(["train", "tl16", "set", "-q"]) == 0
    assert main(["benchmark", "set", "--methods", "none,runs/tl16", "-q"]) == 0
    assert capsys.readouterr().out.count("world (a.h5), sensor cabin") == 1

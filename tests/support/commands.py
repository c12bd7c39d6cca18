"""Commands as a user types them."""

from magsim.cli import main


def run(capsys, *args):
    """Exit code, output and errors of a command; a traceback is never among them."""
    code = main([str(arg) for arg in args])
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return code, out.out, out.err

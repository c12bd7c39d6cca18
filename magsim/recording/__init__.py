"""Recordings: one flight's table of inputs, labels, truth and segments; their files, windows and checks."""

from magsim.recording.recording import TRUTHS, MissingColumnError, Recording, read_recordings, write_recordings

__all__ = ["TRUTHS", "MissingColumnError", "Recording", "read_recordings", "write_recordings"]

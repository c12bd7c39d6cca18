"""Subjects of ``sweep_scaling.py``."""

"""Subjects of ``physics_methods.py``."""

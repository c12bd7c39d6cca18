"""Rows of ``population.py``, one module for each subject."""

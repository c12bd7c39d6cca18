"""Rows of ``flight_realism.py``, one module for each subject; each has a function ``rows()``."""

"""Rows of ``tow_accuracy.py``, one module for each subject; each has a function ``rows()``."""

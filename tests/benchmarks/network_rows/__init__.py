"""Subjects of ``network_accuracy.py`` and ``network_adds.py``, and the search of ``network_tuning.py``."""

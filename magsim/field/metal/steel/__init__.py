"""Soft magnetic steel: shapes, the equations of its magnetization, and the steel of one aircraft."""

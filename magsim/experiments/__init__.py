"""Experiments: what joins simulating and scoring."""

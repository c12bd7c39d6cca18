"""Diagnosis: what a flight can tell about an aircraft, and what a fitted method makes of it."""

"""Wires, the loads that draw current through them, and the voltages of the buses."""

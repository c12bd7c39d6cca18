"""Helpers of the tests: worlds with known truth, carriers, ropes, crafted files."""

"""The aircraft as a flight model of JSBSim."""

"""The field without the aircraft: main field, crust, targets and time variation, at a flight and at a base station."""

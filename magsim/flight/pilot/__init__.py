"""Who flies the model along its path: guidance, sine trains and their calibration, the log."""

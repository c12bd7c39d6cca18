"""Paper 001: a perceptron with skips on one flight of a drone, applied to another."""

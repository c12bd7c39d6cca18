"""Paper 004: a small perceptron for each part of the measured field, by Levenberg-Marquardt."""

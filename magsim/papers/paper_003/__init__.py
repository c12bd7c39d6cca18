"""Paper 003, LSTM-BP: recurrent networks on interference that is drawn from Tolles-Lawson coefficients."""

"""Methods that want to win without being right, and how the ladder judges them."""

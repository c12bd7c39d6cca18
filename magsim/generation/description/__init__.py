"""What a data set holds and how it is described: samples, statistics, card and metadata."""

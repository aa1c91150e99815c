"""Reports: one self-contained HTML page each, that opens without a network and prints."""

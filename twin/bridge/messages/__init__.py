"""Messages from and to plain values, YAML, CSV and text."""

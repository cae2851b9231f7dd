"""Files that users name: read with care, written whole."""

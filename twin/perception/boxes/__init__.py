"""Boxes that stand on a shelf or a table, of any size and colour, found in images of depth and colours."""

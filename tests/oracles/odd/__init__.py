"""Odd, bad and hostile robot files, each with what `twin convert` has to make of it."""

"""The mutants that ship."""

"""A digital twin for mobile robots; `docs/architecture.md` is the map of this package."""

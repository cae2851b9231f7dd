"""A physical robot beside its virtual one: what stands in for it, what follows it, how far they are apart."""

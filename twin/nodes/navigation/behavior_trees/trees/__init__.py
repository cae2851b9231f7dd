"""The trees that come with twin, in the format and with the nodes of Nav2."""

"""The nodes of navigation: names, topics and actions of Nav2."""

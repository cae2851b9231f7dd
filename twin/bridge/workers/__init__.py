"""Groups of nodes of one bus in several processes, each a fork of the one that made them all."""

"""Workers: processes that run the nodes of some of a run's robots, beside its physics.

Each is a fork of the run as it was built, so it has the nodes, maps and the model already. In every tick in
which its robots have something to do it is told the state of the physics and what others told its nodes, and
answers with what these did and want the actuators to do. It samples their lidars, too. Physics, all other
sensors, checks and recording stay in the run's own process. Any number of workers gives the same digest.
"""

"""By which names others reach the futures of a run."""

NODE = "/futures"
RUN, SNAPSHOT = f"{NODE}/run", f"{NODE}/snapshot"
"""Services of std_srvs/Trigger; their messages are JSON, or why there is none."""

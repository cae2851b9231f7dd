"""Commands of robots that live by the clock on the wall."""

"""Rerun recordings of runs: writing, the screen they open with, playing and reading them back."""

import os

os.environ.setdefault("RERUN_ANALYTICS", "0")
# What its file writer says of a full disk is said in our words, without colours in a pipe.
os.environ.setdefault("RUST_LOG", "warn,re_log_encoding=off,re_sdk=off")

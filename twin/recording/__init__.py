"""Rerun recordings of runs: writing, the screen they open with, playing and reading them back."""

import os

os.environ.setdefault("RERUN_ANALYTICS", "0")
# What its writers say of a full disk, or a viewer that does not read, is said in our words, without colours.
_SILENT = ("re_log_encoding", "re_sdk", "re_quota_channel", "re_grpc_server")
os.environ.setdefault("RUST_LOG", ",".join(("warn", *(f"{part}=off" for part in _SILENT))))

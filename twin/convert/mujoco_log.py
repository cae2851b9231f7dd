"""MuJoCo's warnings go to Python's logging, not to stderr and a MUJOCO_LOG.TXT in the current folder."""

import logging

import mujoco

mujoco.set_mju_user_warning(logging.getLogger("twin.mujoco").info)

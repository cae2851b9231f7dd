"""Model predictive path integral control: many noisy rollouts, averaged by how well they do.

`controller.py` makes one command: it looks (`scene.py`), adds noise to the controls, drives and
scores every copy (`rollouts.py`, its loop in `rollout_kernel.py`; `path_critics.py`, `scoring.py`), and moves
the controls (`controls.py`). What passes between them is in `arrays.py`.
"""

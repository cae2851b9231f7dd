"""Nav2's own defaults, for tests/navigation/test_nav2_defaults.py, read from a clone of navigation2:

    python tests/oracles/nav2_defaults.py navigation2        # writes tests/oracles/nav2_defaults.json

Of each component the parameters that its sources declare with a number or a truth value. A name that is
declared with several values is left out. The committed file is of Nav2's main branch at a3a97043ee93.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

OUTPUT = Path(__file__).with_suffix(".json")
COMPONENTS = {
    "amcl": ("nav2_amcl/src",),
    "behaviors": ("nav2_behaviors/plugins", "nav2_behaviors/include"),
    "docking controller": ("nav2_docking/opennav_docking/src/controller.cpp",),
    "regulated pure pursuit": ("nav2_regulated_pure_pursuit_controller/src",),
    "rotation shim": ("nav2_rotation_shim_controller/src",),
}
_DECLARED = re.compile(r'"(?:[a-z]\w*\.)?\.?(\w+)",\s*(?:rclcpp::ParameterValue\()?(-?\d[\d.]*|true|false)\)')


def main() -> None:
    repository, found = sys.argv[1], {}
    for component, places in COMPONENTS.items():
        listed = ("git", "-C", repository, "grep", "-h", "", "HEAD", "--", *places)
        text = subprocess.run(listed, capture_output=True, text=True, check=True).stdout
        values: dict[str, set[object]] = {}
        for name, value in _DECLARED.findall(text):
            values.setdefault(name, set()).add(json.loads(value.rstrip(".") if "." in value[-1:] else value))
        found[component] = {name: v.pop() for name, v in sorted(values.items()) if len(v) == 1}
    OUTPUT.write_text(json.dumps(found, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()

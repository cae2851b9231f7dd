"""Asks rtamt: a line of JSON with a formula and traces in, a line with the margin at the start out.

Runs in an environment of its own, where twin is not installed.
"""

import json
import sys
import warnings

warnings.simplefilter("ignore")  # its ANTLR is older than its parser

import rtamt  # noqa: E402


def discrete(question):
    spec = rtamt.StlDiscreteTimeSpecification()
    for name in question["trace"]:
        spec.declare_var(name, "float")
    spec.set_sampling_period(1, "s", 0.1)
    spec.unit = "s"
    spec.spec = question["formula"]
    spec.parse()
    moments = [t for t, _ in next(iter(question["trace"].values()))]
    data = {name: [value for _, value in values] for name, values in question["trace"].items()}
    return spec.evaluate({"time": moments, **data})[0][1]


def dense(question):
    spec = rtamt.StlDenseTimeSpecification()
    for name in question["trace"]:
        spec.declare_var(name, "float")
    spec.spec = question["formula"]
    spec.parse()
    found = spec.evaluate(*[[name, values] for name, values in question["trace"].items()])
    return found[0][1]


for line in sys.stdin:
    asked = json.loads(line)
    print(json.dumps({"discrete": discrete, "dense": dense}[asked["time"]](asked)), flush=True)

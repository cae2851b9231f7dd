from __future__ import annotations

import pytest

from twin.bridge.bus import Bus
from twin.bridge.msgs import String
from twin.bridge.names import RemapRule, Resolver, expand, renamed
from twin.errors import BridgeError


@pytest.mark.parametrize(
    ("name", "full"),
    [
        ("~", "/r/amcl"),
        ("~/scan", "/r/amcl/scan"),
        ("{node}/scan", "/r/amcl/scan"),
        ("{ns}/scan", "/r/scan"),
        ("/{namespace}x", None),
        ("_hidden/a_1", "/r/_hidden/a_1"),
        ("/a{node}b", "/aamclb"),
    ],
)
def test_substitutions_as_in_rcl(name: str, full: str | None) -> None:
    if full is None:
        with pytest.raises(BridgeError, match="it becomes //rx, with //"):
            expand(name, "/r", "amcl")
    else:
        assert expand(name, "/r", "amcl") == full


# The cases of rcl's test_validate_topic_name.cpp, and some more.
@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("", "must not be empty"),
        ("123abc", "no token may start with a digit"),
        ("foo/123bar", "no token may start with a digit"),
        (" ", "letters, digits, _"),
        ("foo bar", "letters, digits, _"),
        ("foo\nbar", "letters, digits, _"),
        ("/~", "~ may only be the first"),
        ("~foo", "~ must be followed by /"),
        ("foo~", "~ may only be the first"),
        ("foo/~bar", "~ may only be the first"),
        ("foo/~/bar", "~ may only be the first"),
        ("foo/", "must not end with /"),
        ("/", "must not end with /"),
        ("a//b", "must not contain //"),
        ("foo/bar}/baz", "every { needs its }"),
        ("foo/{bar", "every { needs its }"),
        ("{{bar}_baz}", "every { needs its }"),
        ("{$}", "it may substitute {node}"),
        ("foo/{bar/baz}", "it may substitute {node}"),
        ("{1foo}", "it may substitute {node}"),
        ("a" * 300, "247 characters"),
    ],
)
def test_errors_say_which_rule_is_broken(name: str, rule: str) -> None:
    with pytest.raises(BridgeError) as caught:
        expand(name, "/", "n")
    assert rule in str(caught.value)
    assert "valid: tokens" in str(caught.value)


def test_the_first_rule_that_fits_counts() -> None:
    rules = [RemapRule.parse(t) for t in ("other:a:=x", "n:a:=/y", "a:=z", "rosservice://b:=~/c", "__ns:=/q")]
    resolver = Resolver("/r", "n", {}, rules)
    assert [resolver.resolve(name) for name in ("a", "/r/a", "b", "/a")] == ["/y", "/y", "/r/n/c", "/a"]


def test_nodes_are_renamed() -> None:
    rules = [RemapRule.parse(t) for t in ("b:__node:=c", "a:__node:=d", "__ns:=/q", "__name:=e")]
    assert renamed("a", "", rules) == ("d", "/q")
    assert renamed("x", "", rules) == ("e", "/q")


def test_nodes_of_one_program_follow_their_own_rules(bus: Bus) -> None:
    node = bus.create_node("n", "r", remappings={"chatter": "/talk", "~/x": "x"})
    assert node.create_publisher(String, "chatter").name == "/talk"
    assert node.resolve_name("~/x") == "/r/x"


@pytest.mark.parametrize("name", ["{ns}", "{namespace}"])
def test_the_namespace_of_the_root_is_a_slash(name: str) -> None:
    """rcl substitutes '/', so '{ns}scan' is '/scan' and '{ns}/scan' no name."""
    assert expand(f"{name}scan", "/", "amcl") == "/scan"
    with pytest.raises(BridgeError, match="it becomes //scan, with //"):
        expand(f"{name}/scan", "/", "amcl")

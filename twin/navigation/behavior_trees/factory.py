"""From an XML file to a tree that can be ticked: which types there are, what is wrong with a file."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from types import ModuleType

from twin.errors import NavigationError, Problem, nearest
from twin.navigation.behavior_trees import decorators, leaves, nav2_control, sequences
from twin.navigation.behavior_trees.blackboard import Blackboard
from twin.navigation.behavior_trees.node import DecoratorNode, NodeSetup, Status, TreeContext, TreeNode
from twin.navigation.behavior_trees.ports import is_pointer, read_value
from twin.navigation.behavior_trees.xml_file import Element, TreeFile, read_file

_DEEPEST = 64
"""More levels than this are a mistake; BehaviorTree.CPP allows 256."""

_MOST_WAKE_UPS = 1000
"""In one tick. BehaviorTree.CPP never returns from a `Repeat` for ever of what succeeds at once."""

Registry = Mapping[str, type[TreeNode]]
"""Type as the XML writes it -> class."""


def nodes_of(*modules: ModuleType) -> Registry:
    """Return the types that modules define, by their names; private and abstract ones are bases of others."""
    return {
        name: cls
        for module in modules
        for name, cls in vars(module).items()
        if isinstance(cls, type) and issubclass(cls, TreeNode) and cls.__module__ == module.__name__
        if not name.startswith("_") and not cls.__abstractmethods__
    }


BASIC_NODES: Registry = {
    **nodes_of(sequences, decorators, leaves, nav2_control),
    "SequenceStar": sequences.SequenceWithMemory,
    "RetryUntilSuccesful": decorators.RetryUntilSuccessful,
}
"""Those that need nothing but a clock, by their present and old names."""


class _SubTree(DecoratorNode):
    """The root of a tree inside of another one."""

    def tick(self) -> Status:
        """Tick it."""
        self.set_status(Status.RUNNING)
        return self.child.execute_tick()


class Tree:
    """A tree that can be ticked."""

    def __init__(self, name: str, root: TreeNode, blackboard: Blackboard) -> None:
        self.name = name
        """ID in the file."""
        self.root = root
        self.blackboard = blackboard

    def tick(self) -> Status:
        """Tick from the root, again while a node asks for it (BehaviorTree.CPP's tickOnce); its status.

        A root that has ended keeps its status; `halt` before the next start, as the navigator does.
        """
        context, status = self.root.context, self.root.execute_tick()
        for _ in range(_MOST_WAKE_UPS):
            if status is not Status.RUNNING or not context.woken:
                break
            context.woken = False
            status = self.root.execute_tick()
        return status

    def halt(self) -> None:
        """Stop whatever runs, and have every node begin anew at the next tick (haltTree)."""
        self.root.reset()
        for node in self.nodes():
            if node.children:
                node.halt()

    def nodes(self) -> Iterator[TreeNode]:
        """Iterate over all nodes, parents first."""
        stack = [self.root]
        while stack:
            node = stack.pop()
            yield node
            stack.extend(reversed(node.children))


class TreeBuilder:
    """Makes trees of one file, which was found to be good."""

    def __init__(self, path: Path, registry: Registry) -> None:
        """Read and check a file with what it includes.

        Raises:
            NavigationError: every fault, each with file and line.
        """
        found = read_file(path)
        self._trees, self._registry = found.trees, registry
        problems = list(found.problems)
        for tree in found.trees.values():
            problems += self._faults(tree.children[0], 1)
        self.main = found.main or ""
        if not problems:
            problems += self._main_faults(found) or self._cycles()
        if problems:
            raise NavigationError(problems)
        self.main = found.main or next(iter(found.trees))

    def build(self, context: TreeContext, blackboard: Blackboard) -> Tree:
        """Return the main tree, its nodes made."""
        self._count = 0
        root = self._make(self._trees[self.main].children[0], context, blackboard)
        return Tree(self.main, root, blackboard)

    # What is wrong with a file

    def _main_faults(self, found: TreeFile) -> list[Problem]:
        if found.main is None and len(found.trees) != 1:
            return [Problem(f"main_tree_to_execute must name one of: {', '.join(found.trees)}", found.path)]
        if found.main is not None and found.main not in found.trees:
            said = f"main_tree_to_execute names no tree {found.main!r}; {nearest(found.main, found.trees)}"
            return [Problem(said, found.path)]
        return []

    def _faults(self, element: Element, depth: int) -> Iterator[Problem]:
        if depth > _DEEPEST:
            yield element.problem(f"nested deeper than {_DEEPEST} levels")
            return
        if element.subtree is not None:
            yield from self._subtree_faults(element)
            return
        cls = self._registry.get(element.type)
        if cls is None:
            yield element.problem(_unknown(element.type, [*self._registry, "SubTree"]))
        else:
            yield from _port_faults(element, cls)
            yield from _child_faults(element, cls)
        for child in element.children:
            yield from self._faults(child, depth + 1)

    def _subtree_faults(self, element: Element) -> Iterator[Problem]:
        if element.children:
            yield element.problem("a SubTree has no children")
        if element.subtree not in self._trees:
            valid = nearest(element.subtree or "", self._trees)
            yield element.problem(f"there is no tree {element.subtree!r}; {valid}")
        yield from (element.problem(_no_script(key)) for key in element.attributes if key in _CONDITIONS)

    def _cycles(self) -> list[Problem]:
        try:
            TopologicalSorter({name: _subtrees(tree) for name, tree in self._trees.items()}).prepare()
        except CycleError as error:
            around: list[str] = error.args[1][::-1]
            said = f"tree {around[0]!r} contains itself: {' > '.join(around)}"
            return [self._trees[around[0]].problem(said)]
        return []

    # From elements to nodes

    def _make(self, element: Element, context: TreeContext, blackboard: Blackboard) -> TreeNode:
        self._count += 1
        uid = self._count
        if element.subtree is None:
            cls: type[TreeNode] = self._registry[element.type]
            children = tuple(self._make(child, context, blackboard) for child in element.children)
            ports = {key: text for key, text in element.attributes.items() if not key.startswith("_")}
        else:
            cls, ports = _SubTree, {}
            inner = _inner_blackboard(element, blackboard)
            children = (self._make(self._trees[element.subtree].children[0], context, inner),)
        setup = NodeSetup(
            name=element.name, uid=uid, context=context, blackboard=blackboard, ports=ports, children=children
        )
        return cls(setup)


_ROUTE_NODES = (
    *("ComputeRoute", "ComputeAndTrackRoute", "CancelComputeAndTrackRoute"),
    *("ExtractRouteNodesAsGoals", "WouldARouteRecoveryHelp"),
)


_LIST = "docs/navigation/behavior-trees.md"


def _unknown(type_: str, valid: list[str]) -> str:
    if type_ in _ROUTE_NODES:
        return f"<{type_}> belongs to Nav2's route server, which is not here"
    close = difflib.get_close_matches(type_, valid, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(close)}?" if close else f"{_LIST} lists those there are"
    return f"there is no node <{type_}>; {hint}"


_CONDITIONS = (
    *("_failureIf", "_successIf", "_skipIf", "_while"),
    *("_onSuccess", "_onFailure", "_onHalted", "_post"),
)


def _no_script(key: str) -> str:
    return f"{key} is a script, and scripts are not run here; use a condition node"


def _port_faults(element: Element, cls: type[TreeNode]) -> Iterator[Problem]:
    ports = {port.name: port for port in cls.PORTS}
    for key, text in element.attributes.items():
        if key in _CONDITIONS:
            yield element.problem(_no_script(key))
        elif key.startswith("_"):
            continue  # notes of editors such as Groot
        elif key not in ports:
            valid = nearest(key, ports) if ports else "it has none"
            yield element.problem(f"<{element.type}> has no port {key!r}; {valid}")
        elif not ports[key].is_output and not is_pointer(text):
            try:
                read_value(text, ports[key].type)
            except ValueError as error:
                yield element.problem(f"{key}={text!r} of <{element.type}> {error}")
    for name, port in ports.items():
        if port.required and name not in element.attributes:
            yield element.problem(f"<{element.type}> needs {name}")


def _child_faults(element: Element, cls: type[TreeNode]) -> Iterator[Problem]:
    count, (least, most) = len(element.children), cls.CHILDREN
    if count >= least and (most is None or count <= most):
        return
    wanted = f"{least} or more" if most is None else str(least) if least == most else f"{least} to {most}"
    yield element.problem(f"<{element.type}> must have {wanted} children, not {count}")


def _subtrees(element: Element) -> Iterator[str]:
    if element.subtree is not None:
        yield element.subtree
    for child in element.children:
        yield from _subtrees(child)


def _inner_blackboard(element: Element, outer: Blackboard) -> Blackboard:
    """Return a subtree's blackboard: entries in braces are the outer tree's, other texts constants."""
    if element.shares_blackboard:
        return outer
    attributes = dict(element.attributes)
    autoremap = "true" in (attributes.pop("_autoremap", ""), attributes.pop("__autoremap", ""))
    given = {key: text for key, text in attributes.items() if not key.startswith("_")}
    remapping = {key: key if text == "{=}" else text[1:-1] for key, text in given.items() if is_pointer(text)}
    inner = Blackboard(outer, remapping, autoremap=autoremap)
    for key, text in given.items():
        if key not in remapping:
            inner.keep(key, text)
    return inner

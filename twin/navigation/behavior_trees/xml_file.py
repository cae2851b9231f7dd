"""Behaviour trees as XML elements with their lines: files of BehaviorTree.CPP 3 and 4, with includes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from lxml import etree

from twin.errors import Problem
from twin.files.reading import read_bytes

_EXPLICIT = ("Action", "Condition", "Control", "Decorator", "SubTree", "SubTreePlus")


@dataclass(frozen=True, kw_only=True)
class Element:
    """One tag."""

    type: str
    """The node's type: the tag, or its ID where the tag is `Action`, `Control` and so on."""
    name: str
    attributes: dict[str, str]
    """Without `ID` and `name`."""
    children: tuple[Element, ...]
    file: Path
    line: int
    subtree: str | None = None
    """ID of the tree that stands here."""
    shares_blackboard: bool = False

    def problem(self, message: str) -> Problem:
        """Return a fault of this element."""
        return Problem(message, self.file, self.line)


@dataclass(kw_only=True)
class TreeFile:
    """What a file and those it includes hold."""

    path: Path
    main: str | None = None
    """Tree to execute, as the first file says."""
    trees: dict[str, Element] = field(default_factory=dict)
    """ID -> the `BehaviorTree` element."""
    problems: list[Problem] = field(default_factory=list)

    def refuse(self, message: str, file: Path, line: int | None = None) -> None:
        """Note a fault."""
        self.problems.append(Problem(message, file, line))


def read_file(path: Path) -> TreeFile:
    """Read a file with everything it includes; faults are in `problems`, all of them."""
    found = TreeFile(path=path)
    _read(path, found, ())
    return found


def _read(
    path: Path, found: TreeFile, around: tuple[Path, ...], included_at: tuple[Path, int] | None = None
) -> None:
    parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
    try:
        root = etree.fromstring(read_bytes(path), parser)
    except OSError as error:
        said = f"cannot be read: {error.strerror or error}"
        return found.refuse(f"{path} {said}", *included_at) if included_at else found.refuse(said, path)
    except etree.XMLSyntaxError as error:
        return found.refuse(f"not well-formed XML: {error.msg}", path, error.lineno)
    if root.tag != "root":
        return found.refuse(f"the outermost tag is <{root.tag}>, not <root>", path, root.sourceline)
    is_third = root.get("BTCPP_format", "3") != "4"
    if not around:
        found.main = root.get("main_tree_to_execute")
    for tag in root:
        if tag.tag == "include":
            _include(tag, path, found, (*around, path.resolve()))
        elif tag.tag == "BehaviorTree":
            _add_tree(_element(tag, path, is_third, found.problems), found)
        elif tag.tag != "TreeNodesModel":
            said = f"<{tag.tag}> is not known here; valid: <BehaviorTree>, <include>, <TreeNodesModel>"
            found.refuse(said, path, tag.sourceline)
    return None


def _include(tag: etree._Element, path: Path, found: TreeFile, around: tuple[Path, ...]) -> None:
    at, target = (path, tag.sourceline), tag.get("path")
    if target is None or tag.get("ros_pkg") is not None:
        said = "<include> needs a path relative to its file; ROS packages (ros_pkg) are not searched"
        found.refuse(said, *at)
    elif (included := path.parent / target).resolve() in around:
        found.refuse(f"{target} includes itself", *at)
    else:
        _read(included, found, around, at)


def _add_tree(tree: Element, found: TreeFile) -> None:
    name = tree.name or f"BehaviorTree_{len(found.trees)}"
    before = found.trees.get(name)
    if before is not None:
        found.problems.append(tree.problem(f"tree {name!r} is there already: {before.file}:{before.line}"))
    elif len(tree.children) != 1:
        said = f"tree {name!r} must have exactly one child, not {len(tree.children)}"
        found.problems.append(tree.problem(said))
    else:
        found.trees[name] = tree


def _element(tag: etree._Element, path: Path, is_third: bool, problems: list[Problem]) -> Element:
    attributes = {str(key): str(value) for key, value in tag.attrib.items()}
    type_, id_ = str(tag.tag), attributes.pop("ID", None)
    is_explicit = type_ in _EXPLICIT
    if is_explicit and id_ is None:
        problems.append(Problem(f"<{type_}> needs an attribute ID", path, tag.sourceline))
    is_subtree = type_ in ("SubTree", "SubTreePlus")
    if is_third and type_ == "SubTree":  # version 3 writes the names of entries without braces
        attributes = {key: _braced(key, value) for key, value in attributes.items()}
    name = id_ or "" if type_ == "BehaviorTree" else attributes.pop("name", id_ or type_)
    return Element(
        type="SubTree" if is_subtree else (id_ or type_) if is_explicit else type_,
        name=name,
        attributes=attributes,
        children=tuple(_element(child, path, is_third, problems) for child in tag),
        file=path,
        line=tag.sourceline,
        subtree=(id_ or "") if is_subtree else None,
        shares_blackboard=attributes.pop("__shared_blackboard", "") == "true",
    )


def _braced(key: str, value: str) -> str:
    return value if key.startswith("_") or key == "name" or value.startswith("{") else f"{{{value}}}"

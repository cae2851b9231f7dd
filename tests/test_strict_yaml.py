"""Every fault of a file is reported at once, each at its line, with what would be valid."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Literal

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, TypeAdapter, model_validator

from twin.errors import MapError
from twin.parameters import (
    Hertz,
    Joules,
    Kilograms,
    Metres,
    MetresPerSecond,
    Newtons,
    Radians,
    RadiansPerSecond,
    Seconds,
)
from twin.strict_yaml import Fault, Faults, StrictModel, load


class Physics(StrictModel):
    timestep: Annotated[Seconds, Field(gt=0)] = 0.002
    """Physics step [s]."""


class Box(StrictModel):
    type: Literal["box"]
    size: tuple[Metres, Metres]


class Ball(StrictModel):
    type: Literal["ball"]
    radius: Metres = 0.1


class File(StrictModel):
    name: str
    physics: Physics = Physics()
    shapes: tuple[Annotated[Box | Ball, Field(discriminator="type")], ...] = ()
    count: int = 1
    base: Literal["free", "fixed"] = "free"
    flag: bool = False

    @model_validator(mode="after")
    def _fits(self) -> File:
        if self.count != 1:
            raise Faults(
                [Fault(("count",), "count must be 1"), Fault(("physics", "timestep"), "and so must this")]
            )
        return self


def read(tmp_path: Path, text: str, **overrides: str) -> File:
    path = tmp_path / "file.yaml"
    path.write_text(text, encoding="utf-8")
    return load(
        path, File, error=MapError, overrides={key.replace("__", "."): v for key, v in overrides.items()}
    )


def faults(tmp_path: Path, text: str, **overrides: str) -> list[str]:
    with pytest.raises(MapError) as caught:
        read(tmp_path, text, **overrides)
    return [str(problem).replace(str(tmp_path) + "/", "") for problem in caught.value.problems]


def test_reads_values_units_and_defaults(tmp_path: Path) -> None:
    text = "name: a\nphysics: {timestep: 20 ms}\nshapes:\n- {type: box, size: [35 cm, 2]}\n- type: ball\n"
    file = read(tmp_path, text)
    assert file.physics.timestep == 0.02
    assert file.shapes == (Box(type="box", size=(0.35, 2.0)), Ball(type="ball"))


def test_yaml_1_2_scalars(tmp_path: Path) -> None:
    assert read(tmp_path, "name: on\nphysics: {timestep: 1e-3}").model_dump()["physics"] == {
        "timestep": 0.001
    }
    assert read(tmp_path, "name: on").name == "on"
    assert read(tmp_path, "name: 2026-11-21").name == "2026-11-21"
    assert read(tmp_path, "name: a\ncount: 0x1").count == 1


def test_aliases_are_values(tmp_path: Path) -> None:
    text = "name: a\nshapes:\n- &b {type: ball, radius: 1}\n- *b\n"
    assert [shape.model_dump()["radius"] for shape in read(tmp_path, text).shapes] == [1.0, 1.0]


def test_all_problems_at_once_in_file_order(tmp_path: Path) -> None:
    text = """\
nam: x
physics:
  timestp: 1 ms
  timestep: 3 kg
shapes:
  - type: box
    sise: [1, 2]
  - {type: bal}
  - {type: ball, radius: wide}
  - 5
  - {}
base: fre
flag: yes
count: 1.5
flag: true
"""
    assert faults(tmp_path, text) == [
        "file.yaml:1: unknown key 'nam'; did you mean 'name'? "
        "Valid: base, count, flag, name, physics, shapes",
        "file.yaml:3: unknown key 'timestp' in physics; did you mean 'timestep'? Valid: timestep",
        "file.yaml:4: physics.timestep: must have a unit of time (s, ms, us, min, h), not '3 kg'",
        "file.yaml:7: unknown key 'sise' in shapes.0; did you mean 'size'? Valid: size, type",
        "file.yaml:8: shapes.1.type: unknown value 'bal'; did you mean 'ball'? Valid: ball, box",
        "file.yaml:9: shapes.2.radius: must be a number (length in m) "
        "or text with a unit (m, cm, mm, km), not 'wide'",
        "file.yaml:10: shapes.3: must be a mapping (key: value), not 5",
        "file.yaml:11: missing key 'type' in shapes.4",
        "file.yaml:12: base: unknown value 'fre'; did you mean 'free'? Valid: fixed, free",
        "file.yaml:13: flag: must be true or false, not 'yes'",
        "file.yaml:14: count: must be a whole number, not 1.5",
        "file.yaml:15: duplicate key 'flag', first given in line 13; keep one of them",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "file.yaml:1: the file is empty"),
        ("- a\n", 'file.yaml:1: the file: must be a mapping (key: value), not ["a"]'),
        ("name: [a\n", "file.yaml:2: invalid YAML: while parsing a flow sequence, expected ',' or ']'"),
        ("name: a\n\tcount: 1\n", "file.yaml:2: invalid YAML: while scanning for the next token"),
        ("name: a\nphysics: {timestep: 0}\n", "file.yaml:2: physics.timestep: must be greater than 0, not 0"),
        (
            "name: a\nphysics: {timestep: .nan}\n",
            "file.yaml:2: physics.timestep: must be a number (time in s)",
        ),
        (
            "name: a\nphysics: {timestep: true}\n",
            "file.yaml:2: physics.timestep: must be a number (time in s)",
        ),
        ("name: 3\n", "file.yaml:1: name: must be text, not 3"),
        ("name: ''\n", "file.yaml:1: name: must not be empty, not ''"),
        ("name: a\nphysics: null\n", "file.yaml:2: physics: must be a mapping (key: value), not null"),
        ("name: a\n? [x]\n: 1\n", "file.yaml:2: a key must be text"),
        ("name: a\nshapes: &s [*s]\n", "file.yaml:2: alias contains itself or grows without end"),
        (
            "name: a\nshapes:\n- {type: box, size: [1, 2, 3]}\n",
            "file.yaml:3: shapes.0.size: must have at most 2 items, not [1,2,3]",
        ),
        (
            "name: a\nshapes:\n- {type: box, size: [1]}\n",
            "file.yaml:3: shapes.0.size: must have at least 2 items",
        ),
        ("a: 1\n---\nb: 2\n", "file.yaml:2: invalid YAML: expected a single document"),
    ],
)
def test_one_fault(tmp_path: Path, text: str, message: str) -> None:
    assert any(fault.startswith(message) for fault in faults(tmp_path, text)), faults(tmp_path, text)


def test_aliases_that_multiply_end_soon(tmp_path: Path) -> None:
    rows = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 9)]
    assert any("grows without end" in fault for fault in faults(tmp_path, "\n".join(["a0: &a0 [x]", *rows])))


def test_a_file_without_a_bottom_is_refused(tmp_path: Path) -> None:
    assert "nested too deeply" in faults(tmp_path, "[" * 3000)[0]


def test_missing_file_and_wrong_encoding(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"no\.yaml: no such file$"):
        load(tmp_path / "no.yaml", File, error=MapError)
    (tmp_path / "latin.yaml").write_bytes(b"name: caf\xe9\n")
    with pytest.raises(MapError, match="not UTF-8 text: byte 9 is 0xe9"):
        load(tmp_path / "latin.yaml", File, error=MapError)


def test_faults_of_a_models_own_validator_have_lines(tmp_path: Path) -> None:
    text = "name: a\ncount: 2\nphysics:\n  timestep: 1\n"
    assert faults(tmp_path, text) == ["file.yaml:2: count must be 1", "file.yaml:4: and so must this"]


def test_faults_behind_other_faults_are_found_in_the_same_go(tmp_path: Path) -> None:
    text = "name: a\ncount: 2\nphysics:\n  timestep: 1\n  tmestep: 1\n"
    assert [fault.partition(": ")[2][:10] for fault in faults(tmp_path, text)] == [
        "count must",
        "and so mus",
        "unknown ke",
    ]


def test_a_key_that_is_less_alike_is_suggested_but_its_value_not_held_against_the_suggestion(
    tmp_path: Path,
) -> None:
    assert faults(tmp_path, "name: a\nphysics:\n  testing: 1 kg\n") == [
        "file.yaml:3: unknown key 'testing' in physics; did you mean 'timestep'? Valid: timestep",
    ]


def test_a_misspelling_hides_no_fault_behind_it_and_makes_none(tmp_path: Path) -> None:
    assert faults(tmp_path, "nme: 3\nphysics:\n  tmestep: 1 kg\n") == [
        "file.yaml:1: unknown key 'nme'; did you mean 'name'? "
        "Valid: base, count, flag, name, physics, shapes",
        "file.yaml:1: name: must be text, not 3",
        "file.yaml:3: unknown key 'tmestep' in physics; did you mean 'timestep'? Valid: timestep",
        "file.yaml:3: physics.timestep: must have a unit of time (s, ms, us, min, h), not '1 kg'",
    ]
    assert faults(tmp_path, "name: a\nbase: fre\ncount: 2\n") == [
        "file.yaml:1: and so must this",
        "file.yaml:2: base: unknown value 'fre'; did you mean 'free'? Valid: fixed, free",
        "file.yaml:3: count must be 1",
    ]
    assert len(faults(tmp_path, "name: a\nxyz: 1\n")) == 1


def test_overrides_replace_and_add_values(tmp_path: Path) -> None:
    text = "name: a\nshapes:\n- {type: ball}\n"
    file = read(tmp_path, text, physics__timestep="5 ms", shapes__0__radius="1 m", name="b")
    assert (file.name, file.physics.timestep, file.shapes[0].model_dump()["radius"]) == ("b", 0.005, 1.0)


def test_faults_of_overrides_name_the_override(tmp_path: Path) -> None:
    text = "name: a\nshapes:\n- {type: ball}\n"
    overrides = {
        "name__x": "3",
        "base": "[",
        "physics__timestp": "4",
        "shapes__1__radius": "1",
        "flag": "1",
    }
    assert sorted(faults(tmp_path, text, **overrides)) == [
        "override base=[: invalid YAML: while parsing a flow node, "
        "expected the node content, but found '<stream end>'",
        "override flag=1: flag: must be true or false, not 1",
        "override name.x=3: name is 'a' and has no key 'x'",
        "override physics.timestp=4: unknown key 'timestp' in physics; "
        "did you mean 'timestep'? Valid: timestep",
        "override shapes.1.radius=1: no item '1' in shapes; valid: indices 0 to 0",
    ]


@pytest.mark.parametrize(
    ("unit", "text", "value"),
    [
        (Seconds, "4 min", 240.0),
        (Seconds, "20ms", 0.02),
        (Metres, "35 cm", 0.35),
        (Metres, "-5 mm", -0.005),
        (Radians, "90 deg", math.pi / 2),
        (Radians, "-180 °", -math.pi),
        (Kilograms, "250 g", 0.25),
        (MetresPerSecond, "36 km/h", 10.0),
        (RadiansPerSecond, "60 rpm", 2 * math.pi),
        (Newtons, "1.5 kN", 1500.0),
        (Hertz, "10 Hz", 10.0),
        (Joules, "1 Wh", 3600.0),
        (Joules, "2.5e1 J", 25.0),
    ],
)
def test_units(unit: object, text: str, value: float) -> None:
    adapter = TypeAdapter(unit)
    assert adapter.validate_python(text) == pytest.approx(value, rel=1e-15)
    jsonschema.validate(text, adapter.json_schema())
    jsonschema.validate(value, adapter.json_schema())


@given(st.integers(-(10**6), 10**6))
def test_decimal_units_round_once(number: int) -> None:
    assert TypeAdapter(Seconds).validate_python(f"{number} ms") == number / 1000


def test_json_schema_has_descriptions_and_forbids_unknown_keys() -> None:
    schema = File.model_json_schema()
    assert schema["$defs"]["Physics"]["properties"]["timestep"]["description"] == "Physics step [s]."
    assert schema["additionalProperties"] is False
    jsonschema.Draft202012Validator.check_schema(json.loads(json.dumps(schema)))

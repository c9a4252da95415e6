"""`result.json`: all of its parts together.

`python -m reports.result > reports/result.schema.json` renews the schema; a test holds it current.
"""

import json
import sys
from typing import Literal

from reports.parts import (
    AlignmentPart,
    AssessmentPart,
    FlightPart,
    MismatchPart,
    MotionsPart,
    PackPart,
    Part,
    ProvenancePart,
    QualityPart,
    ReplayPart,
    SegmentPart,
)

SCHEMA_VERSION: Literal[1] = 1


class Result(Part):
    """One analysed flight."""

    schema_version: Literal[1] = SCHEMA_VERSION
    flight: FlightPart
    pack: PackPart
    quality: QualityPart
    alignment: AlignmentPart | None
    segments: tuple[SegmentPart, ...]
    motions: MotionsPart
    replay: ReplayPart
    assessment: AssessmentPart | None
    """Null if the damage could not be judged; the warning `no_damage` in `quality` says why."""
    mismatch: MismatchPart | None
    """Null if it could not be judged; the warning `no_mismatch` in `quality` says why."""
    provenance: ProvenancePart


def schema_text() -> str:
    """The JSON Schema of `result.json`, as it is shipped."""
    schema = Result.model_json_schema(mode="serialization")
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return json.dumps(schema, indent=1) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text())

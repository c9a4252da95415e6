"""What can be wrong with a log: errors that stop, warnings that are shown."""

from dataclasses import dataclass


class LogError(Exception):
    """Base of all this package raises; the text names file, place, expectation and remedy."""


class NotALog(LogError):
    """The bytes are no flight log of a known format."""


class LogDamaged(LogError):
    """The file is a log, but nothing of use can be recovered from it."""


class Refusal(LogError):
    """The log is readable, but its flight cannot be analysed; `code` names the reason.

    Codes: `no_flight` (bench run, never airborne), `no_battery` (no battery channel), `no_current`,
    `no_voltage`, `fixed_wing`, `vtol`, `helicopter`, `not_multirotor`, `too_short`.
    """

    def __init__(self, code: str, message: str) -> None:
        self.code = code
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class LogWarning:
    """Usable, but doubtful: shown in the report and counted in `result.json`.

    Attributes:
        code: stable snake_case name, e.g. `current_scale_doubtful`.
        message: one sentence for a person, with the numbers.
        where: topic, field, or time span concerned; "" for the whole log.
    """

    code: str
    message: str
    where: str = ""

"""What can go wrong."""

from __future__ import annotations


class GripperError(Exception):
    """Something went wrong with the gripper or the line to it."""


class NoAnswer(GripperError):
    """The gripper does not answer, or what answers is damaged."""


class RequestRejected(GripperError):
    """The gripper answered a request with a Modbus exception; nothing was changed."""

    def __init__(self, what: str, code: int) -> None:
        meaning = {
            1: "it does not know the function",
            2: "there is no such register, or it cannot be written",
            3: "a value is outside its range",
            4: "it has failed",
            6: "it is busy",
        }.get(code, "no known reason")
        super().__init__(f"{what}: exception {code}: {meaning}")
        self.code = code
        """The Modbus exception code."""


class Refused(GripperError):
    """The gripper did not carry out a command."""

    def __init__(self, what: str, reason: int, detail: int) -> None:
        text = REFUSALS.get(reason, "a reason that this version of the package does not know")
        super().__init__(f"{what}: refused: {text} (refusal {reason}, detail {detail})")
        self.reason = reason
        """Number of the refusal, as in the register map."""
        self.detail = detail
        """What belongs to it: for a payload that is too heavy the mass in g that would be possible."""


class Dropped(GripperError):
    """A stop or a release by the digital inputs came before the command was carried out."""


class WaitTimeout(GripperError):
    """What was waited for did not come in time."""


REFUSALS = {
    1: "the pressure is not between zero and the highest",
    2: "no pressure up to the highest bends the fingers that far",
    3: "mass or acceleration is not a positive number",
    4: "no pressure up to the highest lifts that much; the detail is the mass in g that would be possible",
    5: "the finger's table does not know what is lifted",
    6: "a fault is latched",
    7: "a loss is latched",
    8: "a tare or a sweep needs open fingers without pressure",
    9: "a sweep is running",
    10: "a tare gave no new zeros; the detail says why",
    11: "a sweep has learned nothing; the detail says why",
}

"""Drives a softgrip soft gripper, or the virtual one, over Modbus RTU.

>>> from softgrip import Gripper
>>> with Gripper("/tmp/softgrip") as gripper:
...     gripper.grip_payload(mass_g=80, acceleration_m_s2=2.0)
...     if gripper.wait_holding():
...         print("holding", gripper.status())
...     gripper.open()
"""

from ._errors import (
    Dropped,
    GripperError,
    NoAnswer,
    Refused,
    RequestRejected,
    WaitTimeout,
)
from ._gripper import Gripper, write_csv
from ._status import Loss, LossCause, State, Status
from ._settings import Settings

__all__ = [
    "Dropped",
    "Gripper",
    "GripperError",
    "Loss",
    "LossCause",
    "NoAnswer",
    "Refused",
    "RequestRejected",
    "Settings",
    "State",
    "Status",
    "WaitTimeout",
    "write_csv",
]

"""pyRobotiqGripper 1.0.1, on minimalmodbus: function 03 to read, 16 with three registers to write."""

import pyrobotiqgripper
from virtual import until


def test_it_loses_what_it_carries_and_knows(patient, story):
    gripper = pyrobotiqgripper.RobotiqGripper(story.port)
    # Its search for a gripper wants this echo before any activation.
    gripper.write_registers(1000, [0, 100, 0])
    assert gripper.read_registers(2000, 3, 4)[1] & 0xFF == 100

    def shown(name: str) -> int:
        gripper.readAll()
        return gripper.paramDic[name]

    gripper.resetActivate()
    assert (shown("gSTA"), shown("gFLT"), shown("gACT")) == (3, 0, 1)
    position, detected = gripper.goTo(255)
    assert detected and 3 < position <= 230
    assert shown("gOBJ") == 2 and shown("gPR") == 255 and shown("gCU") > 100

    until("the object is lost", lambda: shown("gOBJ") == 3)
    until("the log says so", lambda: story.said("LOST"))
    assert shown("gPR") == 255

    position, detected = gripper.goTo(0)
    assert not detected
    until("it is open", lambda: gripper.getPosition() <= 5)
    # It is acknowledged, or this would be refused.
    position, detected = gripper.goTo(255)
    assert not detected and position > 50

    gripper.write_registers(1000, [0x3100, 0, 0])
    assert shown("gFLT") == 0xB
    until("the automatic release has ended", lambda: shown("gFLT") == 0xF)
    gripper.resetActivate()
    assert shown("gFLT") == 0
    gripper.serial.close()

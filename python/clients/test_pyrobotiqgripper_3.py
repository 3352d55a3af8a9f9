"""pyRobotiqGripper 3.3.14, on pymodbus 3: function 04 to read, 23 to move, 16 with one register to activate."""

import pyrobotiqgripper as rq
from virtual import until


def drive(gripper: rq.RobotiqGripper, is_lost) -> None:
    """From activation to automatic release."""
    gripper.activate()
    status = gripper.status()
    assert (status["gSTA"], status["gACT"], status["gFLT"]) == (3, 1, 0)
    gripper.start()
    gripper.close()
    assert gripper.objectDetection() == 2
    assert gripper.status()["gPR"] == 255
    assert 3 < gripper.position() <= 230
    assert gripper.status()["gCU"] > 100

    until("the object is lost", lambda: gripper.objectDetection() == 3)
    until("the log says so", is_lost)
    assert gripper.status()["gPR"] == 255

    gripper.open()
    assert gripper.objectDetection() == 3
    until("it is open", lambda: gripper.position() <= 5)
    # It is acknowledged, or this would be refused.
    gripper.close()
    assert gripper.objectDetection() == 3
    assert gripper.position() > 50

    gripper._writeA(rARD=1, rATR=1, rGTO=0, rACT=1)
    gripper.readStatus(raiseOnFault=False)
    assert gripper.status(refreshStatus=False)["gFLT"] == 0xB

    def is_released() -> bool:
        gripper.readStatus(raiseOnFault=False)
        return gripper.status(refreshStatus=False)["gFLT"] == 0xF

    until("the automatic release has ended", is_released)
    gripper.activate()
    assert gripper.status()["gFLT"] == 0


def test_it_loses_what_it_carries_and_knows(story):
    gripper = rq.RobotiqGripper(com_port=story.port, connection_type=rq.GRIPPER_MODE_RTU)
    drive(gripper, lambda: story.said("LOST"))
    gripper.disconnect()


def test_it_does_the_same_over_tcp(serve):
    from conftest import STORY

    virtual = serve("--tcp", "127.0.0.1:0", script=STORY)
    host, port = virtual.port.rsplit(":", 1)
    gripper = rq.RobotiqGripper(
        connection_type=rq.GRIPPER_MODE_RTU_VIA_TCP, tcp_host=host, tcp_port=int(port)
    )
    drive(gripper, lambda: virtual.said("LOST"))
    gripper.disconnect()

"""What drivers do that cannot be installed here, frame by frame, as their sources say."""

from compatible import ACT, ATR, GTO, Raw, pause, read_frame
from virtual import until


def test_ros2_robotiq_gripper(story):
    """The C++ driver of ros2_robotiq_gripper: every 10 ms the same write, then six registers of which it wants exactly
    17 bytes. It checks neither checksum nor id, and never flushes."""
    client = Raw(story.port)
    client.write([0, 0, 0])
    client.write([ACT, 0, 0])
    # One status right after the activation says whether it waits for its end.
    assert client.read(6).sta == 1
    until("it is activated", lambda: client.read(6).sta == 3)
    assert client.read(6).flt == 0
    client.write([ACT | GTO, 3, 0xFFFF])
    until("it is open", lambda: client.read(6).obj == 3)

    def turn(position: int):
        client.write([ACT | GTO, position, 0xFFFF])
        shown = client.read(6)
        pause(10)
        return shown

    until("it holds", lambda: turn(230).obj == 2)
    # Rewriting changes nothing: neither the hold nor, later, the loss.
    until("the object is lost", lambda: turn(230).obj == 3)
    for _ in range(100):
        shown = turn(230)
        assert (shown.obj, shown.pr) == (3, 230)
    until("the log says so", lambda: story.said("LOST"))
    assert not story.said("acknowledged", after="LOST")
    until("it is open", lambda: turn(3).po <= 5)
    until("the log says so", lambda: story.said("acknowledged", after="LOST"))


def test_robotiq_hande_driver(story):
    """robotiq_hande_driver: function 23 alone, every 100 ms, whatever has changed."""
    client = Raw(story.port)

    def turn(words: list[int]):
        shown = client.write_read(words)
        pause(100)
        return shown

    turn([0, 0, 0])
    assert turn([ACT, 0, 0]).sta == 1
    until("it is activated", lambda: turn([ACT, 0, 0]).sta == 3)
    until("it holds", lambda: turn([ACT | GTO, 255, 0xFFFF]).obj == 2)
    until("the object is lost", lambda: turn([ACT | GTO, 255, 0xFFFF]).obj == 3)
    until("the log says so", lambda: story.said("LOST"))
    until("it is open", lambda: turn([ACT | GTO, 0, 0xFFFF]).po <= 5)
    until("the automatic release has ended", lambda: turn([ACT | ATR, 0, 0]).flt == 0xF)


def test_robotiq_rs(story):
    """robotiq-rs: any fault at the activation is an error; after each grasp it writes rGTO = 0 and rPR = 0."""
    client = Raw(story.port)
    client.write([0, 0, 0])
    client.write([ACT, 0, 0])

    def is_activated() -> bool:
        shown = client.read()
        assert shown.flt == 0
        return shown.sta == 3

    until("it is activated", is_activated)
    client.write([ACT | GTO, 255, 0xFFFF])
    until("it holds", lambda: client.read().obj != 0)
    assert client.read().obj == 2
    client.write([ACT, 0, 0])
    # That holds the grasp, and is no acknowledgement of a loss.
    until("the object is lost", lambda: client.read().obj == 3)
    until("the log says so", lambda: story.said("LOST"))
    client.write([ACT, 0, 0])
    assert not story.said("acknowledged", after="LOST")
    assert client.read().cu > 50
    client.write([ACT | GTO, 0, 0xFFFF])
    until("it is open", lambda: client.read().obj == 3 and client.read().po <= 5)
    until("the log says so", lambda: story.said("acknowledged", after="LOST"))


def test_polymetis(story):
    """polymetis: activates by rATR with rACT = 0, then 0, then rACT, and looks at the status that it read before each
    write; 60 Hz."""
    client = Raw(story.port)
    client.write([ATR, 0, 0])
    client.write([0, 0, 0])
    client.write([ACT, 0, 0])
    until("it is activated", lambda: client.read().sta == 3)
    assert client.read().flt == 0

    def turn(position: int):
        shown = client.read()
        client.write([ACT | GTO, position, 0xFFFF])
        pause(16)
        return shown

    turn(230)
    until("it holds", lambda: turn(230).obj == 2)
    until("the object is lost", lambda: turn(230).obj == 3)
    until("the log says so", lambda: story.said("LOST"))
    turn(3)
    until("it is open", lambda: turn(3).po <= 5)
    until("the log says so", lambda: story.said("acknowledged", after="LOST"))


def test_a_client_that_repeats_itself_does_not_activate_a_gripper_that_has_restarted(serve, tmp_path):
    link = str(tmp_path / "gripper")
    command = [ACT | GTO, 255, 0xFFFF]
    for _ in range(2):
        virtual = serve("--tty", link)
        client = Raw(virtual.port)
        for _ in range(20):
            shown = client.write_read(command)
            assert (shown.act, shown.sta, shown.cu) == (False, 0, 0)
            pause(10)
        # The log is not needed any more; the link is.
        client.line.close()
        virtual.stop()


def test_a_late_answer_is_not_sent_to_a_client_that_has_given_up(serve, tmp_path):
    """One answer 0.7 s late leaves the ROS 2 driver one answer behind for ever."""
    virtual = serve("--tty", str(tmp_path / "gripper"))
    client = Raw(virtual.port)
    client.write([0, 77, 0])
    with virtual.paused():
        client.line.write(read_frame(6))
        assert client.line.read(17) == b""
        pause(200)
    pause(500)
    assert client.line.in_waiting == 0
    for position in (20, 90, 250):
        client.write([0, position, 0])
        assert client.read(6).pr == position


def test_a_request_that_waits_for_a_moment_is_answered(serve, tmp_path):
    """What a busy machine does to it: the gripper finds the request a little later than it came."""
    virtual = serve("--tty", str(tmp_path / "gripper"))
    client = Raw(virtual.port)
    client.read(6)

    def is_answered() -> bool:
        with virtual.paused():
            client.line.write(read_frame(6))
            pause(40)
        return len(client.line.read(17)) == 17

    # On a machine that makes 100 ms of 40 it is right not to answer.
    assert any(is_answered() for _ in range(10))

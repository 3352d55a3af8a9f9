//! `softgrip panel` as its users call it: what it says, how it ends, and what it refuses.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};

fn softgrip(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softgrip"));
    command.arg("panel").args(args);
    command
}

#[test]
fn it_says_where_the_page_is_serves_it_and_ends_with_ctrl_c() {
    let mut child = softgrip(&["--from", "virtual", "--listen", "127.0.0.1:0"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("softgrip starts");
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let mut line = || lines.next().expect("a line").expect("text");
    assert_eq!(line(), "the virtual gripper: the page is at");
    let address = line();
    let (host, token) = address
        .trim()
        .strip_prefix("http://")
        .and_then(|address| address.split_once("/#token="))
        .expect("an address with a token");
    assert_eq!(token.len(), 32, "{address}");
    assert!(line().contains(&format!("At http://{host}/ it only watches")));

    let mut stream = TcpStream::connect(host).expect("a connection");
    write!(stream, "GET / HTTP/1.1\r\nHost: {host}\r\n\r\n").expect("sent");
    let mut page = String::new();
    stream.read_to_string(&mut page).expect("a page");
    assert!(page.contains("<title>softgrip</title>") && !page.contains(token));

    let id = child.id().to_string();
    let status = Command::new("kill").args(["-INT", &id]).status();
    assert!(status.expect("kill is there").success());
    assert_eq!(child.wait().expect("an end").code(), Some(0));
}

#[test]
fn what_cannot_be_served_is_refused_with_what_would_be_right() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let taken = taken.local_addr().expect("an address").to_string();
    let free = ["--listen", "127.0.0.1:0"];
    for (args, words) in [
        (
            vec!["--from", "virtual", "--listen", &taken],
            "choose another port with --listen",
        ),
        (
            vec!["--from", "virtual", "--listen", "here"],
            "must be an IP address and a port, as in",
        ),
        (
            [&["--from", "tty:/nowhere"][..], &free].concat(),
            "/nowhere: cannot open",
        ),
        (
            [&["--from", "nothing"][..], &free].concat(),
            "must be one of virtual",
        ),
        (vec![], "--from"),
    ] {
        let output = softgrip(&args).output().expect("softgrip starts");
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
        assert!(error.contains(words), "{args:?}: {error}");
        assert!(output.stdout.is_empty(), "{args:?}");
    }
}

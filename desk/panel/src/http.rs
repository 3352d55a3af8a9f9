//! The little of HTTP that a page needs: the head of a GET request, and answers that end the connection.

use std::fmt::Write as _;
use std::io::{ErrorKind, Read};
use std::net::IpAddr;
use std::time::{Duration, Instant};

/// A browser's head is a tenth of that.
const LONGEST_HEAD: usize = 8192;
/// A browser sends some fifteen.
const MOST_HEADERS: usize = 64;
/// Whoever needs longer for a head sends none.
const PATIENCE: Duration = Duration::from_secs(5);

/// The head of a GET request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// What is asked for, without a query.
    pub path: String,
    /// The address that the browser believes to talk to.
    pub host: String,
    /// The page that asks, where a browser tells.
    pub origin: Option<String>,
    /// The key of a WebSocket's handshake.
    pub key: Option<String>,
    /// What came behind the head.
    pub rest: Vec<u8>,
}

/// Why a request is not served: its status, and what is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// Status and its name.
    pub status: &'static str,
    /// What is wrong, and what would be right.
    pub why: String,
}

impl Refusal {
    /// With what is wrong, and what would be right.
    pub fn new(status: &'static str, why: impl Into<String>) -> Self {
        Self {
            status,
            why: why.into(),
        }
    }

    /// As an answer.
    pub fn answer(&self) -> Vec<u8> {
        answer(
            self.status,
            "text/plain; charset=utf-8",
            self.why.as_bytes(),
        )
    }
}

/// Reads the head of a request.
///
/// # Errors
/// If it is no GET request, is too long, or does not come in time; none of it is kept then.
pub fn read(stream: &mut impl Read) -> Result<Request, Refusal> {
    let began = Instant::now();
    let mut head = Vec::new();
    let mut bytes = [0; 1024];
    loop {
        let count = match stream.read(&mut bytes) {
            Ok(0) => return Err(malformed("the request ends within its head")),
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(_) => return Err(too_slow()),
        };
        head.extend_from_slice(&bytes[..count]);
        if let Some(request) = parse(&head)? {
            return Ok(request);
        }
        if head.len() >= LONGEST_HEAD {
            return Err(Refusal::new(
                "431 Request Header Fields Too Large",
                format!("the head must be shorter than {LONGEST_HEAD} bytes"),
            ));
        }
        if began.elapsed() > PATIENCE {
            return Err(too_slow());
        }
    }
}

fn malformed(why: impl Into<String>) -> Refusal {
    Refusal::new("400 Bad Request", why)
}

fn too_slow() -> Refusal {
    Refusal::new("408 Request Timeout", "the request did not come in time")
}

/// The request whose head these bytes are; none if more must come.
fn parse(head: &[u8]) -> Result<Option<Request>, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let length = match parsed.parse(head) {
        Ok(httparse::Status::Complete(length)) => length,
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(error) => return Err(malformed(format!("not an HTTP request: {error}"))),
    };
    if parsed.method != Some("GET") {
        let why = "only GET is served here";
        return Err(Refusal::new("405 Method Not Allowed", why));
    }
    let path = parsed.path.and_then(|target| target.split('?').next());
    let mut request = Request {
        path: path.unwrap_or_default().to_string(),
        host: String::new(),
        origin: None,
        key: None,
        rest: head[length..].to_vec(),
    };
    let mut hosts = 0;
    for header in &*parsed.headers {
        let text = || match std::str::from_utf8(header.value) {
            Ok(text) => Ok(text.trim().to_string()),
            Err(_) => Err(malformed(format!("{}: not UTF-8", header.name))),
        };
        if header.name.eq_ignore_ascii_case("host") {
            hosts += 1;
            request.host = text()?;
        } else if header.name.eq_ignore_ascii_case("origin") {
            request.origin = Some(text()?);
        } else if header.name.eq_ignore_ascii_case("sec-websocket-key") {
            request.key = Some(text()?);
        }
    }
    match hosts {
        1 => Ok(Some(request)),
        _ => Err(malformed("there must be one header Host")),
    }
}

/// Refuses a request that a page from elsewhere has made a browser send. Such a page reaches a server of this machine
/// by a name of its own that leads here (DNS rebinding), or names its own origin. So the address must be a number or
/// `localhost`, of this machine alone where nobody else is served, and the origin the same.
///
/// # Errors
/// With 403, and what would be right.
pub fn check_origin(request: &Request, is_local: bool) -> Result<(), Refusal> {
    let forbidden = |why| Err(Refusal::new("403 Forbidden", why));
    let name = without_port(&request.host);
    let address: Option<IpAddr> = match name.strip_prefix('[').and_then(|n| n.strip_suffix(']')) {
        Some(inner) => inner.parse().ok().filter(IpAddr::is_ipv6),
        None => name.parse().ok().filter(IpAddr::is_ipv4),
    };
    let is_ours = match address {
        Some(address) => !is_local || address.is_loopback(),
        None => name.eq_ignore_ascii_case("localhost"),
    };
    if !is_ours {
        return forbidden(format!(
            "Host {:?} is not served: open the page by the address that the terminal prints",
            request.host
        ));
    }
    match &request.origin {
        Some(origin) if *origin != format!("http://{}", request.host) => forbidden(format!(
            "a page of {origin:?} is not served: open the page by the address that the terminal prints"
        )),
        _ => Ok(()),
    }
}

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    }
}

/// An answer that ends the connection. A page may fetch nothing but from here, and be shown in no other.
pub fn answer(status: &str, content_type: &str, body: &[u8]) -> Vec<u8> {
    let mut head = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        head,
        "HTTP/1.1 {status}\r\n\
         Content-Type: {content_type}\r\n\
         Content-Length: {}\r\n\
         Content-Security-Policy: default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; \
         base-uri 'none'; form-action 'none'\r\n\
         X-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\n\
         Cache-Control: no-store\r\n\
         Connection: close\r\n\r\n",
        body.len()
    );
    [head.as_bytes(), body].concat()
}

/// The answer to a WebSocket's handshake.
pub fn accept_socket(key: &str) -> String {
    format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {}\r\n\r\n",
        tungstenite::handshake::derive_accept_key(key.as_bytes())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives its bytes one by one, as a slow network may.
    struct Drip<'a>(&'a [u8]);

    impl Read for Drip<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            let Some((first, rest)) = self.0.split_first() else {
                return Ok(0);
            };
            buffer[0] = *first;
            self.0 = rest;
            Ok(1)
        }
    }

    fn status(head: &str) -> &'static str {
        read(&mut head.as_bytes()).expect_err(head).status
    }

    #[test]
    fn a_head_is_read_whole_or_byte_by_byte_alike() {
        let head = b"GET /page.js?v=1 HTTP/1.1\r\nhost: 127.0.0.1:80\r\nORIGIN: http://127.0.0.1:80\r\nSec-WebSocket-Key: abc\r\n\r\n";
        let expected = Request {
            path: "/page.js".into(),
            host: "127.0.0.1:80".into(),
            origin: Some("http://127.0.0.1:80".into()),
            key: Some("abc".into()),
            rest: Vec::new(),
        };
        assert_eq!(read(&mut &head[..]), Ok(expected.clone()));
        assert_eq!(read(&mut Drip(head)), Ok(expected.clone()));
        let more = [&head[..], b"\x81\x80"].concat();
        let rest = b"\x81\x80".to_vec();
        assert_eq!(read(&mut &more[..]), Ok(Request { rest, ..expected }));
    }

    #[test]
    fn what_is_no_get_request_is_refused_by_its_status() {
        for (head, expected) in [
            ("", "400 Bad Request"),
            ("GET / HTTP/1.1\r\nHost: a", "400 Bad Request"),
            ("\0\u{1}\u{2}nonsense\r\n\r\n", "400 Bad Request"),
            ("GET / HTTP/1.1\r\n\r\n", "400 Bad Request"),
            (
                "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
                "400 Bad Request",
            ),
            ("GET / HTTP/9.9\r\nHost: a\r\n\r\n", "400 Bad Request"),
            (
                "POST / HTTP/1.1\r\nHost: a\r\n\r\n",
                "405 Method Not Allowed",
            ),
        ] {
            assert_eq!(status(head), expected, "{head:?}");
        }
        let many = "X: y\r\n".repeat(MOST_HEADERS + 1);
        let many = format!("GET / HTTP/1.1\r\n{many}\r\n");
        assert_eq!(status(&many), "400 Bad Request");
    }

    #[test]
    fn a_head_without_end_is_cut_off() {
        let endless = format!("GET /{} HTTP/1.1\r\n", "a".repeat(10 * LONGEST_HEAD));
        let mut bytes = endless.as_bytes();
        let refusal = read(&mut bytes).expect_err("too long");
        assert_eq!(refusal.status, "431 Request Header Fields Too Large");
        let taken = endless.len() - bytes.len();
        assert!(taken <= LONGEST_HEAD, "{taken}");
    }

    fn from(host: &str, origin: Option<&str>, is_local: bool) -> bool {
        let request = Request {
            path: "/".into(),
            host: host.into(),
            origin: origin.map(str::to_string),
            key: None,
            rest: Vec::new(),
        };
        check_origin(&request, is_local).is_ok()
    }

    #[test]
    fn a_name_that_leads_here_and_a_page_from_elsewhere_are_refused() {
        for host in [
            "127.0.0.1:8080",
            "localhost:1",
            "LOCALHOST",
            "[::1]:8080",
            "127.0.0.2",
        ] {
            assert!(from(host, None, true), "{host}");
            assert!(from(host, Some(&format!("http://{host}")), true), "{host}");
        }
        for host in [
            "evil.example:8080",
            "",
            ":80",
            "192.168.1.2:80",
            "127.0.0.1.evil.example",
            "[127.0.0.1]",
            "::1",
            "localhost.",
        ] {
            assert!(!from(host, None, true), "{host}");
        }
        assert!(from("192.168.1.2:80", None, false));
        assert!(!from("robot.example:80", None, false));
        for origin in [
            "http://evil.example",
            "null",
            "https://127.0.0.1:80",
            "http://127.0.0.1:81",
        ] {
            assert!(!from("127.0.0.1:80", Some(origin), true), "{origin}");
        }
    }
}

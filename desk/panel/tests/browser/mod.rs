//! A browser without a window, by the WebDriver protocol: JSON over HTTP to chromedriver, which comes with Debian's
//! packages chromium and chromium-driver.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

const DRIVER: &str = "/usr/bin/chromedriver";
/// The first of them that is there: where both are, the driver is that of the first.
const BROWSERS: [&str; 2] = ["/usr/bin/google-chrome", "/usr/bin/chromium"];
/// A busy machine takes its time.
const PATIENCE: Duration = Duration::from_secs(60);

pub struct Browser {
    driver: Child,
    port: u16,
    session: String,
    _profile: tempfile::TempDir,
    /// It would end where nobody listens.
    _output: BufReader<ChildStdout>,
}

impl Browser {
    /// Starts one in this size. None, and a word about it, where there is none; where `SOFTGRIP_BROWSER` says that one is
    /// required, as in CI, that is a failure.
    pub fn start(width: u32, height: u32, scheme: &str) -> Option<Self> {
        let mut browsers = BROWSERS.into_iter().filter(|path| Path::new(path).exists());
        let (true, Some(binary)) = (Path::new(DRIVER).exists(), browsers.next()) else {
            let required = std::env::var("SOFTGRIP_BROWSER");
            assert_ne!(
                required.as_deref(),
                Ok("required"),
                "chromium or {DRIVER} is missing"
            );
            eprintln!(
                "NOT TESTED: chromium or {DRIVER} is missing (Debian's packages chromium and chromium-driver)"
            );
            return None;
        };
        let profile = tempfile::tempdir().expect("a folder");
        let mut driver = Command::new(DRIVER)
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver");
        let mut output = BufReader::new(driver.stdout.take().expect("its output"));
        let port = loop {
            let mut line = String::new();
            let length = output.read_line(&mut line).expect("its output");
            assert!(length > 0, "chromedriver has ended");
            if let Some((_, port)) = line.split_once("started successfully on port ") {
                break port.trim().trim_end_matches('.').parse().expect("a port");
            }
        };
        let args = json!([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--disable-quic",
            "--no-first-run",
            format!("--user-data-dir={}", profile.path().display()),
            format!("--window-size={width},{height}"),
            format!(
                "--blink-settings=preferredColorScheme={}",
                u8::from(scheme != "dark")
            ),
        ]);
        let capabilities = json!({ "capabilities": { "alwaysMatch": {
            "goog:chromeOptions": { "binary": binary, "args": args },
            "goog:loggingPrefs": { "browser": "ALL" },
        } } });
        let mut browser = Self {
            driver,
            port,
            session: String::new(),
            _profile: profile,
            _output: output,
        };
        let answer = browser
            .http("POST", "/session", &capabilities)
            .expect("chromedriver");
        let session = answer["sessionId"].as_str();
        browser.session = session
            .unwrap_or_else(|| panic!("no browser: {answer}"))
            .to_string();
        // The size of a window is not that of its page.
        browser.ask(
            "POST",
            "/window/rect",
            &json!({ "width": width, "height": height }),
        );
        let missing = browser.script(&format!(
            "return [{width} - innerWidth, {height} - innerHeight]"
        ));
        let size = |i: usize, wanted: u32| u64::from(wanted) + missing[i].as_u64().unwrap_or(0);
        browser.ask(
            "POST",
            "/window/rect",
            &json!({ "width": size(0, width), "height": size(1, height) }),
        );
        Some(browser)
    }

    /// What chromedriver answers to a command of the session.
    fn ask(&self, method: &str, command: &str, body: &Value) -> Value {
        let path = format!("/session/{}{command}", self.session);
        let value = self.http(method, &path, body).expect("chromedriver");
        assert!(value.get("error").is_none(), "{method} {command}: {value}");
        value
    }

    fn http(&self, method: &str, path: &str, body: &Value) -> std::io::Result<Value> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port))?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let body = match body {
            Value::Null => String::new(),
            body => body.to_string(),
        };
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
            self.port,
            body.len()
        )?;
        let mut stream = BufReader::new(stream);
        let mut length = 0;
        loop {
            let mut line = String::new();
            stream.read_line(&mut line)?;
            if line.trim().is_empty() {
                break;
            }
            if let Some((name, value)) = line.split_once(':')
                && name.eq_ignore_ascii_case("content-length")
            {
                length = value.trim().parse().unwrap_or(0);
            }
        }
        let mut body = vec![0; length];
        stream.read_exact(&mut body)?;
        let mut answer: Value = serde_json::from_slice(&body)?;
        Ok(answer["value"].take())
    }

    pub fn open(&self, url: &str) {
        self.ask("POST", "/url", &json!({ "url": url }));
    }

    /// Opens another page, and gives the handle of this one and of that.
    pub fn open_another(&self, url: &str) -> (String, String) {
        let first = self.ask("GET", "/window", &Value::Null);
        let second = self.ask("POST", "/window/new", &json!({ "type": "window" }));
        let handles = [&first, &second["handle"]]
            .map(|handle| handle.as_str().expect("a handle").to_string());
        let [first, second] = handles;
        self.switch_to(&second);
        self.open(url);
        (first, second)
    }

    pub fn switch_to(&self, handle: &str) {
        self.ask("POST", "/window", &json!({ "handle": handle }));
    }

    /// Closes the present page; another must be switched to.
    pub fn close(&self) {
        self.ask("DELETE", "/window", &Value::Null);
    }

    /// What a script returns.
    pub fn script(&self, script: &str) -> Value {
        self.ask(
            "POST",
            "/execute/sync",
            &json!({ "script": script, "args": [] }),
        )
    }

    /// Clicks what a selector finds, as a person would: it must be there to be seen.
    pub fn click(&self, selector: &str) {
        let found = self.ask(
            "POST",
            "/element",
            &json!({ "using": "css selector", "value": selector }),
        );
        let element = found
            .as_object()
            .and_then(|found| found.values().next())
            .and_then(Value::as_str)
            .expect("an element");
        self.ask("POST", &format!("/element/{element}/click"), &json!({}));
    }

    /// Waits until a script returns true.
    pub fn wait_for(&self, condition: &str) {
        let began = Instant::now();
        while self.script(&format!("return Boolean({condition})")) != json!(true) {
            assert!(
                began.elapsed() < PATIENCE,
                "not so in time: {condition}\n{}",
                self.script("return document.body.textContent.replace(/\\s+/g, ' ')")
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Everything that the page has written to the console; the browser writes its errors there, too.
    pub fn console(&self) -> Vec<String> {
        let entries = self.ask("POST", "/se/log", &json!({ "type": "browser" }));
        let entries = entries.as_array().cloned().unwrap_or_default();
        entries.iter().map(Value::to_string).collect()
    }

    /// The processor's time that the browser has taken so far, all of its processes together.
    pub fn seconds(&self) -> f64 {
        let driver = self.driver.id();
        let mut parents = BTreeMap::new();
        for entry in std::fs::read_dir("/proc").expect("processes").flatten() {
            let stat = entry.path().join("stat");
            if let Ok(stat) = std::fs::read_to_string(stat) {
                let (head, tail) = stat.rsplit_once(')').expect("a name in brackets");
                let process: u32 = head
                    .split(' ')
                    .next()
                    .unwrap_or_default()
                    .parse()
                    .expect("a number");
                let parent = tail
                    .split(' ')
                    .nth(2)
                    .unwrap_or_default()
                    .parse()
                    .expect("a number");
                parents.insert(process, (parent, seconds_of(&stat)));
            }
        }
        let is_below = |mut process: u32| {
            while let Some((parent, _)) = parents.get(&process) {
                if *parent == driver {
                    return true;
                }
                process = *parent;
            }
            false
        };
        let all = parents.iter().filter(|(process, _)| is_below(**process));
        all.map(|(_, (_, seconds))| seconds).sum()
    }

    /// A picture of the page, PNG in Base64.
    pub fn picture(&self) -> String {
        let picture = self.ask("GET", "/screenshot", &Value::Null);
        picture.as_str().expect("a picture").to_string()
    }
}

/// Time in user and system mode of a process or a thread, from its `stat` (proc(5)), at Linux's 100 ticks per second.
pub fn seconds_of(stat: &str) -> f64 {
    let (_, tail) = stat.rsplit_once(')').expect("a name in brackets");
    let ticks = tail.split(' ').skip(12).take(2);
    let ticks: u64 = ticks
        .map(|ticks| ticks.parse::<u64>().expect("ticks"))
        .sum();
    ticks as f64 / 100.0
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It takes the browser with it.
        let _ = self.http(
            "DELETE",
            &format!("/session/{}", self.session),
            &Value::Null,
        );
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

//! A workbench that runs, and a client that says exactly what it is told to.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

use serde_json::Value;

use crate::cancel::Cancel;
use crate::workbench::{WorkbenchConfig, serve};

/// Long enough for any answer on a busy machine; nothing waits for it when all is well.
const PATIENCE: Duration = Duration::from_secs(600);

/// A workbench on a port of its own; it ends when this is dropped.
pub struct Running {
    pub port: u16,
    /// First part of every path.
    pub place: String,
    pub token: String,
    cancel: Cancel,
    thread: Option<JoinHandle<()>>,
}

/// An answer.
pub struct Said {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl Running {
    pub fn with(logs: &[PathBuf]) -> Self {
        Self::of(WorkbenchConfig { logs: logs.to_vec(), ..WorkbenchConfig::default() })
    }

    pub fn of(config: WorkbenchConfig) -> Self {
        let (sender, heard) = mpsc::channel();
        let cancel = Cancel::default();
        let thread = std::thread::spawn({
            let cancel = cancel.clone();
            move || {
                serve(&config, &cancel, |address| drop(sender.send(address.to_owned()))).expect("it serves");
            }
        });
        let address = heard.recv_timeout(PATIENCE).expect("an address");
        let (port, rest) =
            address.strip_prefix("http://127.0.0.1:").and_then(|rest| rest.split_once('/')).expect("a port");
        let (place, token) = rest.split_once("/?token=").expect("a path and a token");
        let (port, place, token) = (port.parse().expect("a port"), place.to_owned(), token.to_owned());
        Self { port, place, token, cancel, thread: Some(thread) }
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        stream
    }

    /// The cookie that the token gives.
    pub fn cookie(&self) -> String {
        format!("Cookie: rotorbench_{}={}\r\n", self.port, self.token)
    }

    pub fn host(&self) -> String {
        format!("Host: 127.0.0.1:{}\r\n", self.port)
    }

    /// Sends a head, below the server's own path, and a body as they are.
    pub fn raw(&self, head: &str, body: &[u8]) -> Said {
        self.as_it_is(&head.replacen(" /", &format!(" /{}/", self.place), 1), body)
    }

    /// The same with the path as it is.
    pub fn as_it_is(&self, head: &str, body: &[u8]) -> Said {
        let mut stream = self.connect();
        stream.write_all(format!("{head}Connection: close\r\n\r\n").as_bytes()).expect("sent");
        // A server that has said no before the end of it closes.
        let _ = stream.write_all(body);
        read(&mut stream)
    }

    /// As the page asks.
    pub fn get(&self, path: &str) -> Said {
        self.raw(&format!("GET {path} HTTP/1.1\r\n{}{}", self.host(), self.cookie()), b"")
    }

    pub fn json(&self, path: &str) -> Value {
        let said = self.get(path);
        serde_json::from_str(&said.body).unwrap_or_else(|error| panic!("{path}: {error}: {}", said.body))
    }

    /// As the page acts.
    pub fn act(&self, act: &str) -> Said {
        let head = format!(
            "POST /api/act HTTP/1.1\r\n{}{}Origin: http://127.0.0.1:{}\r\nContent-Length: {}\r\n",
            self.host(),
            self.cookie(),
            self.port,
            act.len()
        );
        self.raw(&head, act.as_bytes())
    }

    /// The desk as soon as it is as it should be.
    pub fn wait_for(&self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let begun = std::time::Instant::now();
        loop {
            let desk = self.json("/api/desk");
            if is_so(&desk) {
                return desk;
            }
            assert!(begun.elapsed() < PATIENCE, "never {what}: {desk:#}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.cancel.request();
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking(), "the server ended by a panic");
        }
    }
}

pub fn read(stream: &mut TcpStream) -> Said {
    let mut bytes = Vec::new();
    // What came before a reset is an answer, too.
    let _ = stream.read_to_end(&mut bytes);
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
    let status = head.split(' ').nth(1).and_then(|word| word.parse().ok()).unwrap_or(0);
    let head = head.to_ascii_lowercase();
    let body = if head.contains("transfer-encoding: chunked") { unchunked(body) } else { body.to_owned() };
    Said { status, head, body }
}

/// What came in pieces, each behind its length.
fn unchunked(mut rest: &str) -> String {
    let mut whole = String::new();
    while let Some((length, behind)) = rest.split_once("\r\n") {
        let length = usize::from_str_radix(length.trim(), 16).unwrap_or(0);
        whole.push_str(&behind[..length]);
        rest = behind[length..].trim_start_matches("\r\n");
    }
    whole
}

//! Who is let in: whoever has the token that the first address carries, from a page of this server and by no other name of
//! this machine.
//!
//! The token is in the address once. The first page goes on to the address without it, and it goes on as a cookie that no script can read and no
//! other site's page can make the browser send. It is for paths below one that nobody can guess, too: else the browser would hand it to
//! every other server of this machine that is opened in it, whatever its port. A name of another host that leads here (DNS rebinding) is refused by `Host`, a
//! page of another site by `Origin` and `Sec-Fetch-Site`.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Read as _;

use axum::http::header::{CONTENT_LENGTH, COOKIE, HOST, ORIGIN};
use axum::http::uri::PathAndQuery;
use axum::http::{HeaderMap, Method, Uri};

use super::WorkbenchError;
use super::thresholds::THRESHOLDS;

/// Bytes of the token.
const TOKEN_BYTES: usize = 32;
/// Bytes of the path's first part.
const PLACE_BYTES: usize = 16;
/// The port of `http://` without one.
const WEB_PORT: u16 = 80;

/// The token, and the port and the path that it is for.
#[derive(Debug, Clone)]
pub(super) struct Door {
    token: String,
    port: u16,
    /// First part of every path.
    place: String,
}

/// How a request is let in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Admission {
    /// With the token in its address: it gets the cookie, and the address without it.
    First,
    /// With the cookie.
    Known,
}

/// Why a request is not let in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum DoorError {
    /// Another name than 127.0.0.1 or localhost.
    #[error("this server answers to 127.0.0.1 only")]
    Host,
    /// A page of another site.
    #[error("a page of another site asked for this")]
    Origin,
    /// Neither token nor cookie.
    #[error("open the address that `rotorbench workbench` printed: it carries a token")]
    Token,
    /// A body that says itself that it is longer than any act of the page.
    #[error("a request may be no longer than {} bytes", THRESHOLDS.largest_body)]
    TooLong,
}

impl Door {
    /// A door with a fresh token.
    pub fn new(port: u16) -> Result<Self, WorkbenchError> {
        let mut bytes = [0; TOKEN_BYTES + PLACE_BYTES];
        let read = File::open("/dev/urandom").and_then(|mut source| source.read_exact(&mut bytes));
        read.map_err(WorkbenchError::System)?;
        let mut token = String::new();
        for byte in bytes {
            // Writing to a string cannot fail.
            let _ = write!(token, "{byte:02x}");
        }
        let place = token.split_off(2 * TOKEN_BYTES);
        Ok(Self { token, port, place })
    }

    /// The address that opens it.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/?token={}", self.port, self.place, self.token)
    }

    /// The cookie that whoever had the token gets. Its name has the port: cookies are a host's, and two workbenches may be open.
    pub fn cookie(&self) -> String {
        format!("rotorbench_{}={}; Path=/{}/; HttpOnly; SameSite=Strict", self.port, self.token, self.place)
    }

    /// What is asked for, without the first part of the path that is this server's.
    pub fn within(&self, uri: &Uri) -> Result<Uri, DoorError> {
        let asked = uri.path_and_query().map(PathAndQuery::as_str);
        let inner = asked.and_then(|path| path.strip_prefix('/')?.strip_prefix(&self.place));
        let inner = inner.filter(|path| path.starts_with('/')).ok_or(DoorError::Token)?;
        inner.parse().map_err(|_| DoorError::Token)
    }

    /// Whether a request is let in, and how; `uri` is what it asks for within.
    pub fn admit(&self, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<Admission, DoorError> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        // A browser leaves out the port that the web has by itself.
        let port = if self.port == WEB_PORT { String::new() } else { format!(":{}", self.port) };
        let own = [format!("127.0.0.1{port}"), format!("localhost{port}")];
        let host = text(HOST.as_str()).filter(|host| own.iter().any(|own| own == host));
        let host = host.filter(|_| headers.get_all(HOST).iter().count() == 1).ok_or(DoorError::Host)?;
        let is_own_page = |origin: &str| origin.strip_prefix("http://") == Some(host);
        match text(ORIGIN.as_str()) {
            Some(origin) if !is_own_page(origin) => return Err(DoorError::Origin),
            // A browser always says where a change comes from.
            None if *method != Method::GET || headers.contains_key(ORIGIN) => return Err(DoorError::Origin),
            _ => {}
        }
        // Typed or opened by another program: `none`.
        if text("sec-fetch-site").is_some_and(|site| !["same-origin", "none"].contains(&site))
            && uri.path() != "/"
        {
            return Err(DoorError::Origin);
        }
        let shown = uri.query().and_then(|query| query.strip_prefix("token="));
        if *method == Method::GET && uri.path() == "/" && shown.is_some_and(|shown| self.is_token(shown)) {
            return Ok(Admission::First);
        }
        let name = format!("rotorbench_{}", self.port);
        let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut pairs =
            cookies.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
        if !pairs.any(|(key, value)| key == name && self.is_token(value)) {
            return Err(DoorError::Token);
        }
        let announced = text(CONTENT_LENGTH.as_str()).and_then(|text| text.parse::<u64>().ok());
        if announced.is_some_and(|bytes| bytes > THRESHOLDS.largest_body as u64) {
            return Err(DoorError::TooLong);
        }
        Ok(Admission::Known)
    }

    /// Compared to its end: the time it takes tells nothing of where they differ.
    fn is_token(&self, shown: &str) -> bool {
        let differing =
            self.token.bytes().zip(shown.bytes()).fold(0, |sum, (own, other)| sum | (own ^ other));
        shown.len() == self.token.len() && differing == 0
    }
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    /// A browser leaves out the port that the web has by itself, and no other.
    #[test]
    fn the_port_of_the_web_is_no_part_of_the_host() {
        let answer = |port: u16, host: &'static str| {
            let door = Door { token: "0a1b".to_owned(), port, place: "c2".to_owned() };
            let headers = HeaderMap::from_iter([(HOST, HeaderValue::from_static(host))]);
            door.admit(&Method::GET, &Uri::from_static("/?token=0a1b"), &headers)
        };
        assert_eq!(answer(80, "127.0.0.1"), Ok(Admission::First));
        assert_eq!(answer(8080, "127.0.0.1:8080"), Ok(Admission::First));
        assert_eq!(answer(8080, "127.0.0.1"), Err(DoorError::Host));
        assert_eq!(answer(80, "elsewhere"), Err(DoorError::Host));
    }

    #[test]
    fn only_what_lies_below_the_path_is_asked_for() {
        let door = Door { token: "0a1b".to_owned(), port: 8080, place: "c2".to_owned() };
        let within = |asked: &'static str| door.within(&Uri::from_static(asked)).map(|uri| uri.to_string());
        assert_eq!(within("/c2/api/plot?log=1"), Ok("/api/plot?log=1".to_owned()));
        assert_eq!(within("/c2/"), Ok("/".to_owned()));
        for other in ["/", "/c2", "/c20/", "/api/desk", "/c3/c2/", "/?c2/"] {
            assert_eq!(within(other), Err(DoorError::Token), "{other}");
        }
        assert!(door.cookie().contains("Path=/c2/;"));
    }
}

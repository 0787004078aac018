//! Who is let in, and what a stranger, a page of another site or a log with a wicked name can do: nothing.

use std::fs;
use std::io::Write as _;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

use super::client::{Running, read};
use crate::bench::BenchConfig;
use crate::workbench::WorkbenchConfig;
use crate::workbench::thresholds::THRESHOLDS;

const LOG: &str = "time_s,command_1,command_2\n0,0.1,0.1\n0.02,0.2,0.1\n0.04,0.1,0.2\n";

/// A folder with a log in it, beside what must stay out of reach.
fn folders() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).expect("made");
    fs::write(inside.join("log.csv"), LOG).expect("written");
    fs::write(folder.path().join("secret.csv"), LOG).expect("written");
    symlink(folder.path().join("secret.csv"), inside.join("link.csv")).expect("linked");
    symlink(folder.path(), inside.join("up")).expect("linked");
    (folder, inside)
}

/// A name as a query has it.
fn escaped(name: &str) -> String {
    name.bytes().map(|byte| format!("%{byte:02X}")).collect()
}

fn running(inside: &Path) -> Running {
    Running::with(&[inside.join("log.csv")])
}

#[test]
fn without_the_token_nothing_is_answered() {
    let (_folder, inside) = folders();
    let it = running(&inside);
    let ask =
        |path: &str, cookie: &str| it.raw(&format!("GET {path} HTTP/1.1\r\n{}{cookie}", it.host()), b"");
    let wrong = "0".repeat(it.token.len());
    for path in
        ["/", "/main.js", "/api/desk", "/api/events", "/api/plot?log=2&pixels=10", "/?token=", "/?token=x"]
    {
        assert_eq!(ask(path, "").status, 403, "{path}");
        assert_eq!(ask(path, &format!("Cookie: rotorbench_{}={wrong}\r\n", it.port)).status, 403, "{path}");
    }
    assert_eq!(ask(&format!("/?token={wrong}"), "").status, 403);
    assert_eq!(ask(&format!("/api/desk?token={}", it.token), "").status, 403, "the first address alone");
    let first = ask(&format!("/?token={}", it.token), "");
    assert_eq!(first.status, 200);
    for word in
        ["httponly", "samesite=strict", "refresh: 0; url=./\r\n", &it.token, &format!("path=/{}/", it.place)]
    {
        assert!(format!("{}\r\n", first.head).contains(word), "{word}: {}", first.head);
    }
    // A cookie is for every port of a host: the path is what no other server knows.
    for path in ["/", "/api/desk", &format!("/?token={}", it.token)] {
        let head = format!("GET {path} HTTP/1.1\r\n{}{}", it.host(), it.cookie());
        assert_eq!(it.as_it_is(&head, b"").status, 403, "{path}");
    }
    let page = it.get("/");
    assert_eq!(page.status, 200);
    assert!(page.head.contains("default-src 'none'") && !page.head.contains("unsafe"), "{}", page.head);
    assert!(page.head.contains("nosniff") && page.head.contains("no-referrer"));
}

#[test]
fn another_host_and_another_origin_are_refused() {
    let (_folder, inside) = folders();
    let it = running(&inside);
    let get = |lines: &str| it.raw(&format!("GET /api/desk HTTP/1.1\r\n{lines}{}", it.cookie()), b"").status;
    assert_eq!(get(&it.host()), 200);
    assert_eq!(get(&format!("Host: localhost:{}\r\n", it.port)), 200);
    for host in ["evil.example", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example", ""] {
        assert_ne!(get(&format!("Host: {host}\r\n")), 200, "{host}");
    }
    assert_ne!(get(""), 200, "no host at all");
    assert_ne!(get(&format!("{}Host: evil.example\r\n", it.host())), 200, "two hosts");
    let own = format!("Origin: http://127.0.0.1:{}\r\n", it.port);
    assert_eq!(get(&format!("{}{own}", it.host())), 200);
    for origin in
        ["http://evil.example", "null", "http://127.0.0.1:1", &format!("https://127.0.0.1:{}", it.port)]
    {
        assert_eq!(get(&format!("{}Origin: {origin}\r\n", it.host())), 403, "{origin}");
    }
    assert_eq!(get(&format!("{}Sec-Fetch-Site: cross-site\r\n", it.host())), 403);
    let act = "{\"act\":\"cancel\"}";
    let post = |origin: &str| {
        let head = format!(
            "POST /api/act HTTP/1.1\r\n{}{}{origin}Content-Length: {}\r\n",
            it.host(),
            it.cookie(),
            act.len()
        );
        it.raw(&head, act.as_bytes()).status
    };
    assert_eq!((post(&own), post(""), post("Origin: http://evil.example\r\n")), (200, 403, 403));
}

#[test]
fn only_files_below_the_named_folders_are_opened() {
    let (folder, inside) = folders();
    let it = running(&inside);
    let open = |path: &Path| it.act(&serde_json::json!({ "act": "open_log", "path": path }).to_string());
    let root = folder.path();
    let outside = [
        root.join("secret.csv"),
        inside.join("../secret.csv"),
        inside.join("link.csv"),
        inside.join("up/secret.csv"),
        inside.join("link.csv#1"),
        "/etc/passwd".into(),
        "../../../../../../etc/passwd".into(),
        "/dev/zero".into(),
        inside.join("pipe.csv"),
    ];
    // To read it would wait for somebody who writes, and every other log behind it.
    let made = Command::new("mkfifo").arg(inside.join("pipe.csv")).status().expect("mkfifo");
    assert!(made.success());
    for path in &outside {
        assert_eq!(open(path).status, 409, "{}", path.display());
        let model = serde_json::json!({ "act": "open_model", "path": path }).to_string();
        assert_eq!(it.act(&model).status, 409, "{}", path.display());
    }
    let list = |folder: &Path| it.get(&format!("/api/files?folder={}", folder.display()));
    assert_eq!(list(root).status, 409);
    assert_eq!(list(&inside.join("..")).status, 409);
    assert_eq!(list(&inside.join("up")).status, 409);
    let listed = list(&inside);
    assert!(listed.status == 200 && listed.body.contains("log.csv"), "{}", listed.body);
    assert!(!listed.body.contains("link.csv") && !listed.body.contains("secret"), "{}", listed.body);
    assert_eq!(open(&inside.join("log.csv")).status, 200);
    assert_eq!(it.json("/api/desk")["logs"].as_array().map(Vec::len), Some(2));
    for path in ["/../Cargo.toml", "/..%2f..%2fetc%2fpasswd", "//etc/passwd", "/page/main.js"] {
        assert_eq!(it.get(path).status, 404, "{path}");
    }
}

/// What was a file when it was opened may be a link to elsewhere when it is read again.
#[test]
fn a_log_that_became_a_link_to_elsewhere_is_not_read_again() {
    let (folder, inside) = folders();
    let it = running(&inside);
    let desk = it.wait_for("open", |desk| desk["logs"][0]["state"] == "open");
    fs::write(folder.path().join("secret.csv"), LOG.to_owned() + "0.06,0.1,0.1\n").expect("written");
    let log = inside.join("log.csv");
    fs::remove_file(&log).expect("removed");
    symlink(folder.path().join("secret.csv"), &log).expect("linked");
    let again = serde_json::json!({ "act": "reread", "log": desk["logs"][0]["id"] });
    assert_eq!(it.act(&again.to_string()).status, 200);
    let desk = it.wait_for("refused", |desk| desk["logs"][0]["stuck"].is_string());
    assert!(desk["logs"][0]["stuck"].as_str().is_some_and(|why| why.contains("is not below")), "{desk}");
    assert_eq!(desk["logs"][0]["rows"], 3);
}

#[test]
fn a_body_of_a_gigabyte_is_refused_before_it_is_read() {
    let (_folder, inside) = folders();
    let it = running(&inside);
    let head = format!(
        "POST /api/act HTTP/1.1\r\n{}{}Origin: http://127.0.0.1:{}\r\n",
        it.host(),
        it.cookie(),
        it.port
    );
    assert_eq!(it.raw(&format!("{head}Content-Length: 1073741824\r\n"), b"{").status, 413);
    // The same without saying how long it is: what is over the limit ends it.
    let mut chunks = Vec::new();
    for _ in 0..=THRESHOLDS.largest_body / 4096 {
        chunks.extend_from_slice(b"1000\r\n");
        chunks.extend_from_slice(&[b' '; 4096]);
        chunks.extend_from_slice(b"\r\n");
    }
    assert_eq!(it.raw(&format!("{head}Transfer-Encoding: chunked\r\n"), &chunks).status, 413);
    assert_eq!(it.get("/api/desk").status, 200);
    for nonsense in [
        "",
        "{}",
        "[]",
        "{\"act\":\"arm\"}",
        "{\"act\":\"show\",\"model\":1,\"shown\":true,\"more\":1}",
        "\u{0}",
    ] {
        assert_eq!(it.act(nonsense).status, 400, "{nonsense}");
    }
    assert_eq!(it.act("{\"act\":\"choose\",\"model\":99}").status, 409);
}

#[test]
fn five_hundred_silent_sockets_keep_nobody_out() {
    let (_folder, inside) = folders();
    let it = running(&inside);
    // One that listens, as a page does, was there before and stays.
    let mut page = it.connect();
    let head = format!("GET /{}/api/events HTTP/1.1\r\n{}{}\r\n", it.place, it.host(), it.cookie());
    page.write_all(head.as_bytes()).expect("sent");
    let mut first = [0; 12];
    std::io::Read::read_exact(&mut page, &mut first).expect("an answer");
    assert_eq!(&first, b"HTTP/1.1 200");
    let silent: Vec<_> = (0..500).map(|_| it.connect()).collect();
    assert_eq!(it.get("/api/desk").status, 200);
    drop(silent);
    assert_eq!(it.act("{\"act\":\"read\"}").status, 200);
    let (mut heard, mut byte) = (Vec::new(), [0; 1]);
    while String::from_utf8_lossy(&heard).matches("data: {").count() < 2 {
        std::io::Read::read_exact(&mut page, &mut byte).expect("the page still hears");
        heard.push(byte[0]);
    }
}

#[test]
fn markup_in_names_is_handed_on_as_text() {
    let (_folder, inside) = folders();
    // With a comma, by which nothing is taken apart.
    let wicked = "<img src=x, onerror=alert(1)>";
    let log = inside.join(format!("{wicked}.csv"));
    fs::write(
        &log,
        LOG.replacen("command_2", &format!("command_2,\"{wicked}\""), 1)
            .replace(",0.1\n", ",0.1,1\n")
            .replace(",0.2\n", ",0.2,2\n"),
    )
    .expect("written");
    let it = Running::with(&[log]);
    let desk = it.wait_for("open", |desk| desk["logs"][0]["state"] == "open");
    assert_eq!(desk["logs"][0]["channels"][2]["name"], wicked);
    let id = &desk["logs"][0]["id"];
    let said = it.get(&format!("/api/plot?log={id}&pixels=100&channel={}", escaped(wicked)));
    assert!(said.head.contains("application/json") && said.body.contains("<img"), "{}", said.body);
    let name = it.get(&format!("/api/export?what=signals&id={id}"));
    assert!(!name.head.contains('<'), "{}", name.head);
}

/// Words by which something could be said to a bench.
const WAYS_TO_A_BENCH: [&str; 8] =
    ["ublisher", "publish", "operator", "crate::can::", "::shm", "arm(", "Role::Control", "socketcan"];

#[test]
fn nothing_of_the_workbench_can_speak_to_a_bench() {
    let room = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src/workbench"));
    let mut looked_at = 0;
    for file in fs::read_dir(room).expect("the room").map(|file| file.expect("an entry").path()) {
        let Ok(text) = fs::read_to_string(&file) else { continue };
        looked_at += 1;
        for way in WAYS_TO_A_BENCH {
            assert!(!text.contains(way), "{} has `{way}`", file.display());
        }
    }
    assert!(looked_at > 15);
    let (_folder, inside) = folders();
    let bench = BenchConfig { name: format!("workbench-{}", std::process::id()), ..BenchConfig::default() };
    let logs = vec![inside.join("log.csv")];
    let it = Running::of(WorkbenchConfig { logs, bench, ..WorkbenchConfig::default() });
    let live = it.json("/api/live?since=0");
    assert_eq!(live["moments"], serde_json::json!([]), "nobody was heard yet: {live}");
}

#[test]
fn a_connection_that_sends_half_a_head_is_dropped_with_the_server() {
    let (_folder, inside) = folders();
    let it = running(&inside);
    let mut half = it.connect();
    half.write_all(b"GET / HT").expect("sent");
    drop(it);
    assert_eq!(read(&mut half).status, 0, "the end of the server is the end of it");
}

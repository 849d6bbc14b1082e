//! Pages of `btf view`, and its server: who may read it, and what of it. What the page draws is tried by
//! scripts/test-browser.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::fixture::{btf, fail, fixture, succeed};

/// A server that is running.
struct Served {
    child: Child,
    port: u16,
    /// The path of the page.
    page: String,
}

impl Served {
    fn start() -> Self {
        let mut command = btf();
        command.arg("view").arg(fixture().model());
        Self::of(command)
    }

    /// A server that may open no more than so many files.
    fn with_files(most: usize) -> Self {
        let mut command = Command::new("sh");
        command.args(["-c", &format!("ulimit -n {most}; exec \"$0\" view \"$1\"")]);
        command.arg(btf().get_program()).arg(fixture().model());
        Self::of(command)
    }

    fn of(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let (port, path) = line.trim().strip_prefix("http://127.0.0.1:").unwrap().split_once('/').unwrap();
        Self { port: port.parse().unwrap(), page: format!("/{path}"), child }
    }

    fn own(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    /// Status and body of an answer.
    fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)]) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        // A server that has seen enough may answer before all is sent.
        let lines: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        write!(stream, "{method} {path} HTTP/1.1\r\n{lines}Connection: close\r\n\r\n").unwrap();
        Self::answer(&mut stream)
    }

    fn answer(stream: &mut TcpStream) -> (u16, Vec<u8>) {
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("no end of the headers");
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), answer[end + 4..].to_vec())
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn only_who_knows_the_address_of_this_machine_reads_the_page() {
    let served = Served::start();
    let own = served.own();
    let host = [("Host", own.as_str())];
    let (status, page) = served.ask("GET", &served.page, &host);
    assert_eq!(status, 200);
    assert!(String::from_utf8(page).unwrap().contains("data-address=\"material\""));
    let (status, material) = served.ask("GET", &format!("{}material", served.page), &host);
    assert_eq!((status, &material[..2]), (200, &[0x1f, 0x8b][..]));

    let origin = format!("http://{own}");
    assert_eq!(served.ask("GET", &served.page, &[host[0], ("Origin", &origin)]).0, 200);
    let longer = format!("{own}0");
    let wrong_token = format!("/{}/", "0".repeat(32));
    for (status, method, path, headers) in [
        (403, "GET", "/", &host[..]),
        (403, "GET", "//", &host),
        (403, "GET", "/material", &host),
        (403, "GET", &wrong_token, &host),
        (403, "GET", &wrong_token[..9], &host),
        (403, "GET", &served.page, &[]),
        (403, "GET", &served.page, &[("Host", "example.org")]),
        (403, "GET", &served.page, &[("Host", &longer)]),
        (403, "GET", &served.page, &[host[0], ("Origin", "http://example.org")]),
        (403, "GET", &served.page, &[host[0], ("Origin", "null")]),
        (403, "GET", &format!("/../..{}", served.page), &host),
        (404, "GET", &format!("{}../../../../etc/passwd", served.page), &host),
        (404, "GET", &format!("{}..%2f..%2fetc/passwd", served.page), &host),
        (404, "GET", &format!("{}index", served.page), &host),
        (405, "POST", &served.page, &host),
        (405, "PUT", &format!("{}material", served.page), &host),
        (405, "DELETE", &served.page, &host),
    ] {
        let (found, body) = served.ask(method, path, headers);
        assert_eq!(found, status, "{method} {path} {headers:?}");
        assert!(body.len() < 100, "{method} {path}: {} bytes", body.len());
    }
    let other = Served::start();
    assert_ne!((other.port, &other.page), (served.port, &served.page), "the same address twice");
}

#[test]
fn a_server_reads_no_more_of_a_request_than_it_needs() {
    let served = Served::start();
    let own = served.own();
    let host = ("Host", own.as_str());
    let long = "a".repeat(9_000_000);
    assert_eq!(served.ask("GET", &format!("/{long}"), &[host]).0, 414);
    assert_eq!(served.ask("GET", &served.page, &[host, ("Long", &long)]).0, 431);
    assert_eq!(served.ask("GET", &served.page, &[("Host", &long)]).0, 431);
    assert_eq!(served.ask("GET", &served.page, &vec![host; 5000]).0, 431);
    assert_eq!(served.ask("GET", &served.page, &[host, host]).0, 400);
    assert_eq!(served.ask("GET", &served.page, &[host, ("no name", "a")]).0, 400);
    assert_eq!(served.ask("\u{1}", &served.page, &[host]).0, 400);
    assert_eq!(served.ask("HEAD", &served.page, &[host]), (200, Vec::new()));
    assert_eq!(served.ask("GET", &served.page, &[host]).0, 200);
}

#[test]
fn a_server_outlives_more_connections_than_it_takes_at_once() {
    // More than it takes, and more than the system lets it have.
    for served in [Served::start(), Served::with_files(24)] {
        let stalled: Vec<TcpStream> = (0..100)
            .map(|_| {
                let mut stream = TcpStream::connect(("127.0.0.1", served.port)).unwrap();
                stream.write_all(b"GET / HTTP/1.1\r\n").unwrap();
                stream
            })
            .collect();
        let own = served.own();
        assert_eq!(served.ask("GET", &served.page, &[("Host", &own)]).0, 200);
        drop(stalled);
        assert_eq!(served.ask("GET", &served.page, &[("Host", &own)]).0, 200);
    }
}

#[test]
fn a_page_is_written_once_and_the_same_by_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first.html", "second.html"].map(|name| folder.path().join(name));
    let export = |path: &std::path::Path, threads: &str| {
        succeed(
            btf().arg("view").arg(fixture().model()).arg("--export").arg(path).args(["--threads", threads]),
        )
    };
    assert!(!export(&first, "1").contains("found done"));
    export(&second, "3");
    let page = std::fs::read_to_string(&first).unwrap();
    assert_eq!(page, std::fs::read_to_string(&second).unwrap());
    assert!(export(&first, "2").contains("found done"));
    assert!(!page.contains("data-address") && page.contains("connect-src 'none'"));
    for (number, line) in page.lines().enumerate() {
        assert!(!line.contains("http://") && !line.contains("https://"), "line {number} asks for something");
    }
    std::fs::write(&first, "another file").unwrap();
    fail(btf().arg("view").arg(fixture().model()).arg("--export").arg(&first), 65);
}

#[test]
fn of_an_enlargement_a_window_is_held() {
    let folder = tempfile::tempdir().unwrap();
    let view = |name: &str, arguments: &[&str]| {
        let mut command = btf();
        command.arg("view").arg(fixture().enlarged()).arg("--model").arg(fixture().model());
        command.arg("--export").arg(folder.path().join(name)).args(arguments);
        command
    };
    let told = succeed(&mut view("part.html", &["--window", "3,2,16,8"]));
    assert!(told.contains("the page holds 16x8, from column 3 and row 2 on"), "{told}");
    succeed(&mut view("whole.html", &[]));
    assert_ne!(
        std::fs::read(folder.path().join("part.html")).unwrap(),
        std::fs::read(folder.path().join("whole.html")).unwrap()
    );
    let told = fail(&mut view("beyond.html", &["--window", "-1,0,16,8"]), 2);
    assert!(told.contains("does not lie within"), "{told}");
    let told = fail(&mut view("large.html", &["--window", "0,0,2000,8"]), 2);
    assert!(told.contains("expected at most 1024"), "{told}");
}

#[test]
fn what_cannot_be_viewed_is_told_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    let mut command = btf();
    let told = fail(command.arg("view").arg(fixture().measurement()).arg("--export").arg(&page), 2);
    assert!(told.contains("expected a model") && told.contains("btf model"), "{told}");
    let mut command = btf();
    command.arg("view").arg(fixture().model()).arg("--export").arg(&page).args(["--window", "0,0,4,4"]);
    let told = fail(&mut command, 2);
    assert!(told.contains("leave out --window"), "{told}");
    let mut command = btf();
    fail(command.arg("view").arg(fixture().model()).arg("--export").arg(&page).arg("--open"), 2);
    assert!(!page.exists());
    let taken = Served::start();
    let mut command = btf();
    let told = fail(command.arg("view").arg(fixture().model()).args(["--port", &taken.port.to_string()]), 74);
    assert!(told.contains("cannot listen"), "{told}");
}

//! A server of one page, for this machine only.
//!
//! It listens on the loopback address and answers to whoever knows the token in the address. Pages of other sites
//! cannot read it: they neither know the token nor come by its name (`Host`) and origin. It reads no files.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::Receiver;

use super::request::{Refusal, Request};
use crate::error::{Error, ErrorKind, Result};
use crate::run::Context;
use crate::run::budget::cannot_start;

/// Time between two looks at whether a stop was asked for.
const LOOK: Duration = Duration::from_millis(100);

/// Connections at once. Others wait until one of these ends: the system holds them.
const MOST_CONNECTIONS: usize = 64;

/// Time that a client may take to read some more of an answer.
const PATIENCE: Duration = Duration::from_secs(10);

/// Time in which what is left of a request is thrown away, so that its sender comes to read the answer.
const LINGER: Duration = Duration::from_secs(2);

/// Time to wait after a connection that could not be taken, as where the system has no more file handles.
const PAUSE: Duration = Duration::from_millis(50);

/// Stack of a thread that answers.
const STACK_BYTES: usize = 256 << 10;

/// A server that listens.
pub struct Server {
    listener: TcpListener,
    site: Arc<Site>,
}

/// What is served, and to whom.
struct Site {
    port: u16,
    token: String,
    page: String,
    packed: Vec<u8>,
    stopped: AtomicBool,
}

impl Server {
    pub(super) fn start(page: String, packed: Vec<u8>, port: u16) -> Result<Self> {
        let unheard = |error: std::io::Error| {
            Error::new(ErrorKind::Io, format!("cannot listen on port {port}: {error}"))
                .hint("leave out --port to take any that is free")
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(unheard)?;
        let port = listener.local_addr().map_err(unheard)?.port();
        let site = Site { port, token: token(), page, packed, stopped: AtomicBool::new(false) };
        Ok(Self { listener, site: Arc::new(site) })
    }

    /// The address for a browser.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.site.port, self.site.token)
    }

    /// Answers until a stop is asked for.
    ///
    /// # Errors
    /// Those of the system.
    pub fn run(self, context: &Context<'_>) -> Result<()> {
        let Self { listener, site } = self;
        let taken_by = Arc::clone(&site);
        std::thread::Builder::new()
            .spawn(move || take(&listener, &taken_by))
            .map_err(|error| cannot_start(1, &error))?;
        while context.check_stop().is_ok() {
            std::thread::sleep(LOOK);
        }
        // One more connection lets the thread that waits for them see that no more are wanted.
        site.stopped.store(true, Ordering::Release);
        // Not for long: where all places are taken nobody accepts it, and the program ends with this thread.
        let _ = TcpStream::connect_timeout(&(Ipv4Addr::LOCALHOST, site.port).into(), LOOK);
        Ok(())
    }
}

/// Takes connections, each into a thread of its own, so that one that sends or reads nothing keeps nobody else waiting.
fn take(listener: &TcpListener, site: &Arc<Site>) {
    let (begin, end) = crossbeam_channel::bounded::<()>(MOST_CONNECTIONS);
    // Waits while all places are taken.
    while begin.send(()).is_ok() && !site.stopped.load(Ordering::Acquire) {
        let place = Place(end.clone());
        let started = listener.accept().and_then(|(stream, _)| {
            let site = Arc::clone(site);
            let answer = move || {
                let _place = place;
                // A browser that goes away meanwhile is no matter.
                let _ = site.answer(stream);
            };
            std::thread::Builder::new().stack_size(STACK_BYTES).spawn(answer)
        });
        if started.is_err() {
            std::thread::sleep(PAUSE);
        }
    }
}

/// One of the places for connections; free again when it is dropped.
struct Place(Receiver<()>);

impl Drop for Place {
    fn drop(&mut self) {
        let _ = self.0.try_recv();
    }
}

impl Site {
    /// Answers one request.
    fn answer(&self, mut stream: TcpStream) -> std::io::Result<()> {
        stream.set_write_timeout(Some(PATIENCE))?;
        let Some(request) = Request::read(&mut stream) else { return Ok(()) };
        let is_head = request.as_ref().is_ok_and(|request| request.method == "HEAD");
        let found = request.and_then(|request| match self.refusal(&request) {
            Some(refusal) => Err(refusal),
            None => self.content(&request.address),
        });
        let (status, kind, bytes) = match found {
            Ok((kind, bytes)) => ("200 OK".to_owned(), kind, bytes),
            Err((status, text)) => {
                (format!("{status} {}", text.trim_end()), "text/plain; charset=utf-8", text.as_bytes())
            }
        };
        let length = bytes.len();
        let head = format!(
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\
             Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
             Cross-Origin-Resource-Policy: same-origin\r\nX-Frame-Options: DENY\r\n\r\n"
        );
        stream.write_all(head.as_bytes())?;
        if !is_head {
            stream.write_all(bytes)?;
        }
        stream.shutdown(Shutdown::Write)?;
        // A connection that is closed while something of it is not read would take the answer with it.
        let until = Instant::now() + LINGER;
        let mut rest = [0; 4 << 10];
        while let Some(left) = until.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) {
            stream.set_read_timeout(Some(left))?;
            if stream.read(&mut rest)? == 0 {
                break;
            }
        }
        Ok(())
    }

    /// What is wrong with who asks, or how.
    fn refusal(&self, request: &Request) -> Option<Refusal> {
        let own = [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)];
        if !request.header("Host").is_some_and(|host| own.iter().any(|own| own == host)) {
            return Some((403, "unknown host\n"));
        }
        if request
            .header("Origin")
            .is_some_and(|origin| !own.iter().any(|own| origin.strip_prefix("http://") == Some(own)))
        {
            return Some((403, "unknown origin\n"));
        }
        match request.method.as_str() {
            "GET" | "HEAD" => None,
            _ => Some((405, "only to be read\n")),
        }
    }

    /// What is at an address.
    fn content(&self, address: &str) -> std::result::Result<(&'static str, &[u8]), Refusal> {
        let path = address.split(['?', '#']).next().unwrap_or_default();
        let (token, rest) = path.strip_prefix('/').and_then(|path| path.split_once('/')).unwrap_or_default();
        if !same(token.as_bytes(), self.token.as_bytes()) {
            return Err((403, "unknown address: take the one that btf view printed\n"));
        }
        match rest {
            "" => Ok(("text/html; charset=utf-8", self.page.as_bytes())),
            "material" => Ok(("application/octet-stream", &self.packed)),
            _ => Err((404, "nothing here\n")),
        }
    }
}

/// 128 bits that nobody can guess: the standard library's hash keys come from the system's random numbers.
fn token() -> String {
    let word = || RandomState::new().build_hasher().finish();
    format!("{:016x}{:016x}", word(), word())
}

/// Whether two texts are the same, without telling by its time where they differ.
fn same(given: &[u8], expected: &[u8]) -> bool {
    given.len() == expected.len()
        && given.iter().zip(expected).fold(0, |differing, (a, b)| differing | (a ^ b)) == 0
}

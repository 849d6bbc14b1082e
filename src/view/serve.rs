//! A server of one page, for this machine only.
//!
//! It listens on the loopback address and answers to whoever knows the token in the address. Pages of other sites
//! cannot read it: they neither know the token nor come by its name (`Host`) and origin. It reads no files.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::sync::Arc;
use std::time::Duration;

use tiny_http::{Header, Method, Request, Response};

use crate::error::{Error, ErrorKind, Result};
use crate::run::Context;

/// Time between two looks at whether a stop was asked for.
const LOOK: Duration = Duration::from_millis(100);

/// A server that listens.
pub struct Server {
    server: tiny_http::Server,
    site: Arc<Site>,
}

/// What is served, and to whom.
struct Site {
    port: u16,
    token: String,
    page: String,
    packed: Vec<u8>,
}

impl Server {
    pub(super) fn start(page: String, packed: Vec<u8>, port: u16) -> Result<Self> {
        let server = tiny_http::Server::http(("127.0.0.1", port)).map_err(|error| {
            Error::new(ErrorKind::Io, format!("cannot listen on port {port}: {error}"))
                .hint("leave out --port to take any that is free")
        })?;
        let port = server.server_addr().to_ip().map_or(port, |address| address.port());
        Ok(Self { server, site: Arc::new(Site { port, token: token(), page, packed }) })
    }

    /// The address for a browser.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.site.port, self.site.token)
    }

    /// Answers until a stop is asked for.
    ///
    /// # Errors
    /// Those of the system.
    pub fn run(&self, context: &Context<'_>) -> Result<()> {
        while context.check_stop().is_ok() {
            let request = self
                .server
                .recv_timeout(LOOK)
                .map_err(|error| Error::new(ErrorKind::Io, format!("cannot listen any more: {error}")))?;
            if let Some(request) = request {
                // One that sends or reads nothing more keeps nobody else waiting.
                let site = Arc::clone(&self.site);
                std::thread::spawn(move || site.answer(request));
            }
        }
        Ok(())
    }
}

impl Site {
    /// Answers one request; a browser that goes away meanwhile is no matter.
    fn answer(&self, request: Request) {
        let found = match self.refusal(&request) {
            Some(refusal) => Err(refusal),
            None => self.content(request.url()),
        };
        let (status, kind, bytes) = match found {
            Ok((kind, bytes)) => (200, kind, bytes),
            Err((status, text)) => (status, "text/plain; charset=utf-8", text.as_bytes()),
        };
        let mut response = Response::from_data(bytes).with_status_code(status);
        for (name, value) in [
            ("Content-Type", kind),
            ("Cache-Control", "no-store"),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("X-Frame-Options", "DENY"),
        ] {
            if let Ok(header) = Header::from_bytes(name, value) {
                response.add_header(header);
            }
        }
        let _ = request.respond(response);
    }

    /// What is wrong with who asks, or how.
    fn refusal(&self, request: &Request) -> Option<(u16, &'static str)> {
        let value = |name: &'static str| {
            request
                .headers()
                .iter()
                .find(|header| header.field.equiv(name))
                .map(|header| header.value.as_str())
        };
        let own = [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)];
        if !value("Host").is_some_and(|host| own.iter().any(|own| own == host)) {
            return Some((403, "unknown host\n"));
        }
        if value("Origin")
            .is_some_and(|origin| !own.iter().any(|own| origin.strip_prefix("http://") == Some(own)))
        {
            return Some((403, "unknown origin\n"));
        }
        match request.method() {
            Method::Get | Method::Head => None,
            _ => Some((405, "only to be read\n")),
        }
    }

    /// What is at an address.
    fn content(&self, address: &str) -> std::result::Result<(&'static str, &[u8]), (u16, &'static str)> {
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

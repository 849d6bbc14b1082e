//! The head of a request, of bounded size and within bounded time: whoever sends it is not known yet.

use std::io::Read;
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The most bytes of a request line: its method and address.
const MOST_LINE: usize = 4 << 10;

/// The most bytes of a request line with all headers; browsers send 1 to 3 kB.
const MOST_HEAD: usize = 32 << 10;

/// The most headers.
const MOST_HEADERS: usize = 100;

/// Time that a client has for the head.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

/// An answer that refuses: the status, and a sentence for the reader.
pub(super) type Refusal = (u16, &'static str);

/// What is asked for, and by whom.
pub(super) struct Request {
    pub(super) method: String,
    pub(super) address: String,
    headers: Vec<(String, String)>,
}

impl Request {
    /// The value of a header, if it is there.
    pub(super) fn header(&self, name: &str) -> Option<&str> {
        let found = self.headers.iter().find(|(found, _)| found.eq_ignore_ascii_case(name));
        found.map(|(_, value)| value.as_str())
    }

    /// Reads the head of a request. None if the client goes away or takes longer than [`PATIENCE`].
    pub(super) fn read(stream: &mut TcpStream) -> Option<Result<Self, Refusal>> {
        let until = Instant::now() + PATIENCE;
        let (mut head, mut part) = (Vec::new(), [0; 4 << 10]);
        loop {
            if let Some(found) = parse(&head) {
                return Some(found);
            }
            let left = until.checked_duration_since(Instant::now()).filter(|left| !left.is_zero())?;
            stream.set_read_timeout(Some(left)).ok()?;
            match stream.read(&mut part) {
                Ok(0) => return None,
                Ok(count) => head.extend_from_slice(part.get(..count)?),
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(_) => return None,
            }
        }
    }
}

/// The request that bytes begin with; none while its head has not ended and may still be of a permitted size.
fn parse(head: &[u8]) -> Option<Result<Request, Refusal>> {
    let line = head.iter().position(|&byte| byte == b'\n').unwrap_or(head.len());
    if line > MOST_LINE {
        return Some(Err((414, "the address is too long\n")));
    }
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(head) {
        // A permitted end may have come with the bytes that pass the limit.
        Ok(httparse::Status::Complete(length)) if length <= MOST_HEAD => {}
        Ok(httparse::Status::Partial) if head.len() <= MOST_HEAD => return None,
        Ok(_) | Err(httparse::Error::TooManyHeaders) => {
            return Some(Err((431, "the headers are too many or too long\n")));
        }
        Err(_) => return Some(Err((400, "no request of HTTP\n"))),
    }
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let headers: Vec<(String, String)> =
        request.headers.iter().map(|header| (header.name.to_owned(), text(header.value))).collect();
    let hosts = headers.iter().filter(|(name, _)| name.eq_ignore_ascii_case("Host")).count();
    match (request.method, request.path) {
        _ if hosts > 1 => Some(Err((400, "more than one host\n"))),
        (Some(method), Some(address)) => {
            Some(Ok(Request { method: method.to_owned(), address: address.to_owned(), headers }))
        }
        _ => Some(Err((400, "no request of HTTP\n"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(head: &[u8]) -> Option<u16> {
        parse(head).map(|found| found.map_or_else(|(status, _)| status, |_| 200))
    }

    #[test]
    fn a_head_is_read_when_it_is_whole_and_refused_when_it_is_too_large() {
        let whole = b"GET /a/?b HTTP/1.1\r\nHost: here\r\nX: \xff\r\n\r\n";
        assert_eq!(status(whole), Some(200));
        (0..whole.len()).for_each(|end| assert_eq!(status(&whole[..end]), None, "{end}"));
        let with = |headers: &str| status(format!("GET / HTTP/1.1\r\n{headers}").as_bytes());
        assert_eq!(with(&"A: b\r\n".repeat(MOST_HEADERS)), None);
        assert_eq!(with(&"A: b\r\n".repeat(MOST_HEADERS + 1)), Some(431));
        assert_eq!(with(&format!("A: {}", "b".repeat(MOST_HEAD))), Some(431));
        assert_eq!(with(&format!("A: {}\r\n\r\n", "b".repeat(MOST_HEAD))), Some(431));
        assert_eq!(status(&[b'a'; MOST_LINE + 1]), Some(414));
        assert_eq!(with("Host: a\r\nhost: b\r\n\r\n"), Some(400));
        assert_eq!(status(b"\x16\x03\x01\x02\x00\x01"), Some(400));
        assert_eq!(status(b"GET / HTTP/1.1\r\nno colon\r\n\r\n"), Some(400));
    }
}

//! The HTTP client that the stores use: requests block, answers are read as they arrive, all are counted.

use bytes::{Bytes, BytesMut};
use chrono::DateTime;
use http::header::{AGE, DATE, RETRY_AFTER};
use http::{HeaderMap, Request, Response, StatusCode};
use http_body::{Body, Frame};
use http_body_util::BodyExt;
use object_store::ClientOptions;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse,
    HttpResponseBody, HttpService,
};
use std::io::{ErrorKind, Read};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use ureq::Agent;
use ureq::tls::{Certificate, RootCerts, TlsConfig};

/// Bytes of an answer that are passed on at a time.
const FRAME: usize = 256 << 10;

/// How long a server may be silent before the request counts as failed.
const SILENCE: Duration = Duration::from_secs(30);

/// How long making a connection may take.
const CONNECT: Duration = Duration::from_secs(10);

/// The longest time that a server can ask us to wait before the next request.
const LONGEST_WAIT: u64 = 60;

/// Redirections that are followed where no credentials are sent.
const REDIRECTIONS: u32 = 5;

/// Requests made, bytes of their answers, and the time at the server.
#[derive(Debug, Default)]
pub struct Counts {
    requests: AtomicU64,
    bytes: AtomicU64,
    /// Seconds since 1970; 0 if no answer told it.
    clock: AtomicI64,
}

impl Counts {
    /// Requests that were made, with those that failed.
    #[must_use]
    pub fn requests(&self) -> u64 {
        self.requests.load(Ordering::Relaxed)
    }

    /// Bytes of the answers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// The latest time that an answer told, in seconds since 1970; none if none did.
    #[must_use]
    pub fn clock(&self) -> Option<i64> {
        Some(self.clock.load(Ordering::Relaxed)).filter(|time| *time > 0)
    }

    /// Notes when an answer was given: a cache between tells the time of its own copy, and how old that is.
    fn note_time(&self, headers: &HeaderMap) {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let date = text(DATE).and_then(|date| DateTime::parse_from_rfc2822(date).ok());
        let age = text(AGE).and_then(|age| age.trim().parse().ok());
        if let Some(date) = date {
            let time = date.timestamp().saturating_add(age.unwrap_or(0));
            self.clock.fetch_max(time, Ordering::Relaxed);
        }
    }
}

/// What a client does about failures.
#[derive(Debug, Default)]
pub(crate) struct Temper {
    /// True if an unknown host is taken for an outage.
    patient: AtomicBool,
    /// When a client that is not patient gives up, whatever its store would repeat.
    until: Option<Instant>,
}

impl Temper {
    /// Repeats as long as the store does.
    pub(crate) fn new(patient: bool) -> Self {
        Self {
            patient: patient.into(),
            until: None,
        }
    }

    /// Gives up after `time`, until it becomes patient.
    pub(crate) fn hasty(time: Duration) -> Self {
        Self {
            patient: false.into(),
            until: Instant::now().checked_add(time),
        }
    }

    /// From now on it is patient.
    pub(crate) fn calm(&self) {
        self.patient.store(true, Ordering::Relaxed);
    }

    fn is_patient(&self) -> bool {
        self.patient.load(Ordering::Relaxed)
    }

    fn gives_up(&self) -> bool {
        !self.is_patient() && self.until.is_some_and(|until| Instant::now() >= until)
    }
}

/// The status of an answer that is not asked for again.
#[derive(Debug)]
struct Refused(StatusCode);

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Refused {}

/// True for a status that stores take for an outage.
fn is_outage(status: StatusCode) -> bool {
    status.is_server_error() || matches!(status.as_u16(), 408 | 429)
}

/// Makes the client of a store.
#[derive(Debug, Clone)]
pub(crate) struct Connector {
    agent: Agent,
    temper: Arc<Temper>,
    counts: Arc<Counts>,
}

impl Connector {
    /// A client; `secure` permits no request without TLS, `follows` follows redirections.
    pub(crate) fn new(
        secure: bool,
        follows: bool,
        temper: Arc<Temper>,
        counts: Arc<Counts>,
    ) -> Self {
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .https_only(secure)
            .max_redirects(if follows { REDIRECTIONS } else { 0 })
            .max_redirects_will_error(false)
            .timeout_connect(Some(CONNECT))
            .timeout_per_read(Some(SILENCE))
            .timeout_per_write(Some(SILENCE))
            .user_agent(concat!("outcrop/", env!("CARGO_PKG_VERSION")))
            .tls_config(TlsConfig::builder().root_certs(roots()).build())
            .build();
        Self {
            agent: config.new_agent(),
            temper,
            counts,
        }
    }
}

/// The system's certificates, or those of `SSL_CERT_FILE`; the browsers' where there are none.
fn roots() -> RootCerts {
    let found = rustls_native_certs::load_native_certs().certs;
    match found.is_empty() {
        true => RootCerts::WebPki,
        false => {
            let own = found.iter().map(|c| Certificate::from_der(c).to_owned());
            RootCerts::Specific(Arc::new(own.collect()))
        }
    }
}

impl HttpConnector for Connector {
    fn connect(&self, _options: &ClientOptions) -> object_store::Result<HttpClient> {
        Ok(HttpClient::new(self.clone()))
    }
}

#[async_trait::async_trait]
impl HttpService for Connector {
    async fn call(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let (head, body) = request.into_parts();
        let body = body.collect().await.map(|all| all.to_bytes());
        let body = body.map_err(|e| HttpError::new(HttpErrorKind::Request, e))?;
        self.counts.requests.fetch_add(1, Ordering::Relaxed);
        let answer = match body.is_empty() {
            true => self.agent.run(Request::from_parts(head, ())),
            false => self.agent.run(Request::from_parts(head, &body[..])),
        };
        let answer = answer.map_err(|e| match self.temper.gives_up() {
            true => HttpError::new(HttpErrorKind::Unknown, e),
            false => failed(e, self.temper.is_patient()),
        })?;
        self.counts.note_time(answer.headers());
        if is_outage(answer.status()) && self.temper.gives_up() {
            return Err(HttpError::new(
                HttpErrorKind::Unknown,
                Refused(answer.status()),
            ));
        }
        wait_as_asked(&answer);
        let (head, body) = answer.into_parts();
        let body = Reading {
            reader: Mutex::new(body.into_reader()),
            counts: self.counts.clone(),
        };
        Ok(Response::from_parts(head, HttpResponseBody::new(body)))
    }
}

/// Waits as long as a server that has too much to do asks for.
fn wait_as_asked<T>(answer: &Response<T>) {
    if !matches!(answer.status().as_u16(), 429 | 503) {
        return;
    }
    let asked = answer.headers().get(RETRY_AFTER);
    let seconds = asked.and_then(|value| value.to_str().ok()?.trim().parse().ok());
    if let Some(seconds) = seconds {
        std::thread::sleep(Duration::from_secs(LONGEST_WAIT.min(seconds)));
    }
}

/// An error with its kind, which says whether the request is repeated.
fn failed(error: ureq::Error, patient: bool) -> HttpError {
    let kind = match &error {
        ureq::Error::Io(e) => kind_of(e),
        ureq::Error::Timeout(_) => HttpErrorKind::Timeout,
        ureq::Error::ConnectionFailed => HttpErrorKind::Connect,
        ureq::Error::HostNotFound if patient => HttpErrorKind::Connect,
        ureq::Error::Protocol(_) | ureq::Error::BodyStalled => HttpErrorKind::Interrupted,
        _ => HttpErrorKind::Unknown,
    };
    HttpError::new(kind, error)
}

fn kind_of(error: &std::io::Error) -> HttpErrorKind {
    match error.kind() {
        ErrorKind::TimedOut | ErrorKind::WouldBlock => HttpErrorKind::Timeout,
        // Certificates that are refused come as this.
        ErrorKind::InvalidData | ErrorKind::InvalidInput => HttpErrorKind::Unknown,
        ErrorKind::ConnectionRefused => HttpErrorKind::Connect,
        _ => HttpErrorKind::Interrupted,
    }
}

/// The body of an answer, read as it arrives.
struct Reading<R> {
    reader: Mutex<R>,
    counts: Arc<Counts>,
}

impl<R: Read + Unpin> Body for Reading<R> {
    type Data = Bytes;
    type Error = HttpError;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, HttpError>>> {
        let mut buffer = BytesMut::zeroed(FRAME);
        let reader = self.reader.get_mut();
        let reader = reader.unwrap_or_else(PoisonError::into_inner);
        let mut done = 0;
        while done < FRAME {
            match reader.read(&mut buffer[done..]) {
                Ok(0) => break,
                Ok(n) => done += n,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Poll::Ready(Some(Err(HttpError::new(kind_of(&e), e)))),
            }
        }
        self.counts.bytes.fetch_add(done as u64, Ordering::Relaxed);
        buffer.truncate(done);
        let frame = (done > 0).then(|| Ok(Frame::data(buffer.freeze())));
        Poll::Ready(frame)
    }
}

//! The server: connections of this machine, each request through the door.

use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::header::{CONTENT_TYPE, REFRESH, SET_COOKIE};
use axum::http::{Request, Response, StatusCode};
use axum::response::Response as Answer;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::task::AbortHandle;

use super::WorkbenchError;
use super::door::{Admission, Door, DoorError};
use super::engine::Engine;
use super::routes::{protect, refuse, router};
use super::thresholds::THRESHOLDS;
use crate::cancel::Cancel;

/// How often the wish to end is looked at.
const LOOK: Duration = Duration::from_millis(50);

/// A socket on this machine's own address.
pub(super) fn listen(port: u16) -> Result<TcpListener, WorkbenchError> {
    let refused = |source| WorkbenchError::Port { port, source };
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(refused)?;
    listener.set_nonblocking(true).map_err(refused)?;
    Ok(listener)
}

/// What is done when the first address was opened.
pub(super) type OnOpened = Arc<dyn Fn() + Send + Sync>;

/// Serves until `cancel` is requested; `opened` hears of it when the address with the token was opened.
pub(super) fn run(
    listener: TcpListener,
    (door, opened): (Door, OnOpened),
    engine: &Arc<Engine>,
    cancel: &Cancel,
) -> Result<(), WorkbenchError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(WorkbenchError::System)?;
    let (house, router) = (Arc::new((door, opened)), router(Arc::clone(engine)));
    let served = runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener).map_err(WorkbenchError::System)?;
        let mut guests = Guests::default();
        while !cancel.is_requested() {
            let Ok(accepted) = tokio::time::timeout(LOOK, listener.accept()).await else { continue };
            // No descriptor left, or a connection that went at once: the next one may be served.
            let Ok((stream, _)) = accepted else {
                tokio::time::sleep(LOOK).await;
                continue;
            };
            let is_known = Arc::new(AtomicBool::new(false));
            if !guests.make_room() {
                continue;
            }
            let served = serve(stream, Arc::clone(&house), router.clone(), Arc::clone(&is_known));
            guests.0.push((tokio::spawn(served).abort_handle(), is_known));
        }
        Ok(())
    });
    // A picture that is being drawn does not hold up the end.
    runtime.shutdown_background();
    served
}

/// Who is connected, the oldest first, and who of them has shown the token.
#[derive(Default)]
struct Guests(Vec<(AbortHandle, Arc<AtomicBool>)>);

impl Guests {
    /// Ends the oldest connection without a token where there are as many as may be; `false` where all have shown theirs.
    fn make_room(&mut self) -> bool {
        self.0.retain(|(task, _)| !task.is_finished());
        if self.0.len() < THRESHOLDS.most_connections {
            return true;
        }
        let stranger = self.0.iter().position(|(_, is_known)| !is_known.load(Ordering::Relaxed));
        if let Some(stranger) = stranger {
            self.0.remove(stranger).0.abort();
        }
        stranger.is_some()
    }
}

/// One connection.
async fn serve(
    stream: tokio::net::TcpStream,
    house: Arc<(Door, OnOpened)>,
    router: Router,
    is_known: Arc<AtomicBool>,
) {
    let service = service_fn(|request: Request<Incoming>| {
        let (house, router, is_known) = (Arc::clone(&house), router.clone(), Arc::clone(&is_known));
        async move { Ok::<_, std::convert::Infallible>(answer(request, &house, router, &is_known).await) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(Duration::from_secs(THRESHOLDS.head_within_s))
        .serve_connection(TokioIo::new(stream), service);
    // A browser that went away is no error.
    let _ = connection.await;
}

async fn answer(
    mut request: Request<Incoming>,
    (door, opened): &(Door, OnOpened),
    router: Router,
    is_known: &AtomicBool,
) -> Answer {
    // Whoever comes by another name of this machine hears of that first.
    let admitted = match door.within(request.uri()) {
        Ok(within) => {
            *request.uri_mut() = within;
            door.admit(request.method(), request.uri(), request.headers())
        }
        Err(error) => door.admit(request.method(), request.uri(), request.headers()).and(Err(error)),
    };
    let mut response = match admitted {
        Ok(Admission::First) => {
            opened();
            enter(door)
        }
        Ok(Admission::Known) => {
            is_known.store(true, Ordering::Relaxed);
            let within = Duration::from_secs(THRESHOLDS.body_within_s);
            // The head of the answer to events comes at once, so this bounds the request alone; drawing takes less.
            let has_body = request.method() != hyper::Method::GET;
            let routed = TowerToHyperService::new(router).call(request.map(Body::new));
            let routed = if has_body { tokio::time::timeout(within, routed).await } else { Ok(routed.await) };
            match routed {
                Ok(Ok(response)) => response,
                Ok(Err(never)) => match never {},
                Err(late) => refuse(StatusCode::REQUEST_TIMEOUT, &late),
            }
        }
        Err(DoorError::TooLong) => refuse(StatusCode::PAYLOAD_TOO_LARGE, &DoorError::TooLong),
        Err(error) => refuse(StatusCode::FORBIDDEN, &error),
    };
    protect(&mut response);
    response
}

/// The cookie, and the address without the token. The page itself goes on to it: behind a redirect the browser would take the
/// request for that of whoever led here, a file or another program's page, and keep a strict cookie back.
fn enter(door: &Door) -> Answer {
    // With an icon of its own: else the browser asks for one, which is not there.
    let page = Body::from("<!doctype html><link rel=\"icon\" href=\"data:,\">");
    let response = Response::builder().header(REFRESH, "0; url=./").header(CONTENT_TYPE, "text/html");
    response.header(SET_COOKIE, door.cookie()).body(page).unwrap_or_default()
}

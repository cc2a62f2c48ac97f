//! The connections of the server: on this machine only, so many at a time, none that dawdles over its headers.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, TcpListener as StdListener};
use std::sync::Arc;
use std::time::{Duration, Instant};

use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;

use super::answers::router;
use super::shown::Shown;
use crate::error::{Error, Result};
use crate::exec::Cancel;

/// Connections at a time; others wait.
const CONNECTIONS: usize = 512;
/// A request's headers have to come within this time, and in so many bytes.
const HEADERS_WITHIN: Duration = Duration::from_secs(10);
const HEADER_BYTES: usize = 32 << 10;
/// How often it is looked whether the server is to end.
const LOOK: Duration = Duration::from_millis(100);

/// How a server is set up.
#[derive(Clone, Copy, Debug, Default)]
pub struct Settings {
    /// The port; none takes a free one.
    pub port: Option<u16>,
    /// How long it serves; none until it is interrupted.
    pub within: Option<Duration>,
}

/// A server that is listening.
#[derive(Debug)]
pub struct Server {
    listener: StdListener,
    address: SocketAddr,
    within: Option<Duration>,
}

impl Server {
    /// Listens on this machine.
    ///
    /// # Errors
    /// When the port is taken.
    pub fn listen(settings: Settings) -> Result<Self> {
        let port = settings.port.unwrap_or(0);
        let refused = |e: std::io::Error| match e.kind() {
            ErrorKind::AddrInUse => {
                let what = format!("port {port} is in use; give another --port, or none to take a free one");
                Error::failed(what).caused_by(e)
            }
            _ => Error::from_io(&format!("cannot listen on port {port}"), &e),
        };
        let listener = StdListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        Ok(Self { listener, address, within: settings.within })
    }

    /// Where the page is, such as `http://127.0.0.1:8000`.
    #[must_use]
    pub fn origin(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Answers until `cancel` says that it is over, or the time is.
    ///
    /// # Errors
    /// When the machine has no room for a server.
    pub fn serve(self, shown: Shown, cancel: &Cancel) -> Result<()> {
        let failed = |e: std::io::Error| Error::from_io("the server cannot be started", &e);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .max_blocking_threads(8)
            .enable_all()
            .build()
            .map_err(failed)?;
        // A time that no clock reaches is none.
        let until = self.within.and_then(|within| Instant::now().checked_add(within));
        runtime.block_on(async {
            let listener = TcpListener::from_std(self.listener).map_err(failed)?;
            let service = TowerToHyperService::new(router(shown));
            let room = Arc::new(Semaphore::new(CONNECTIONS));
            while cancel.check().is_ok() && until.is_none_or(|until| Instant::now() < until) {
                let Ok(Ok(place)) = tokio::time::timeout(LOOK, room.clone().acquire_owned()).await else { continue };
                let Ok(Ok((stream, _))) = tokio::time::timeout(LOOK, listener.accept()).await else { continue };
                let service = service.clone();
                tokio::spawn(async move {
                    let mut http = http1::Builder::new();
                    http.timer(TokioTimer::new()).header_read_timeout(HEADERS_WITHIN).max_buf_size(HEADER_BYTES);
                    // Who has nothing more to ask still waits for the answer.
                    http.half_close(true);
                    // A client that goes away in the midst of an answer is no failure of the server.
                    let _ = http.serve_connection(TokioIo::new(stream), service).await;
                    drop(place);
                });
            }
            Ok(())
        })?;
        runtime.shutdown_timeout(LOOK);
        Ok(())
    }
}
